// Run time against error of one scene:
//
//   render_curve SCENE.xml [--truth T.exr] [--truth-spp N] [--integrator NAME] [--spp
//   A,B,…]
//                [--threads N] [--sampling auto] [-D name=value …]
//
// Each line is a picture of its own: samples, CPU-seconds all in (the scene's reading
// not), the part of them before the first path, and the relative L2 error against the
// truth. Without a file T.exr one is made, of `truth-spp` samples with another seed.
// Below the table, the time at which 2 % and 1 % are reached, from the line through the
// two pictures around them.

#include "core/exr.h"
#include "render/render.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "bench/render/scene_tool.h"

namespace nacre::render {
namespace {

struct Arguments {
  std::string scene;
  std::string truth;
  std::string integrator = "fast";
  int truth_spp = 4096;
  int thread_count = 1;
  std::string sampling = "even";
  std::vector<int> spp{1, 2, 4, 8, 16, 32, 64};
  std::vector<std::string> defines;
};

double RelativeL2(const ExrPart& image, const ExrPart& truth) {
  double difference2 = 0;
  double sum2 = 0;
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    const auto a = static_cast<double>(image.values[i]);
    const auto b = static_cast<double>(truth.values[i]);
    difference2 += (a - b) * (a - b);
    sum2 += b * b;
  }
  return std::sqrt(difference2 / sum2);
}

struct Row {
  double cpu_s;
  double error;
};

void PrintTimeTo(const std::vector<Row>& rows, double error) {
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    if (rows[i].error > error && rows[i + 1].error <= error) {
      const double t =
          std::log(rows[i].error / error) / std::log(rows[i].error / rows[i + 1].error);
      std::printf("%.0f %%: %.1f CPU-s\n",
                  100 * error,
                  rows[i].cpu_s * std::pow(rows[i + 1].cpu_s / rows[i].cpu_s, t));
      return;
    }
  }
  std::printf("%.0f %%: not within these samples\n", 100 * error);
}

void Run(const Arguments& arguments) {
  const Scene scene = ReadDefined(arguments.scene, arguments.defines);
  RenderOptions options;
  options.thread_count = arguments.thread_count;
  ExrPart truth;
  if (!arguments.truth.empty() && std::filesystem::exists(arguments.truth)) {
    truth = ReadExr(arguments.truth).front();
  } else {
    options.spp = arguments.truth_spp;
    options.integrator = arguments.integrator;
    options.points_per_patch = 64;
    options.max_lit_points = 2e7;
    options.lazy = false;
    options.exitance_spacing = 0.5;
    options.seed = 20261122;
    truth = Render(scene, options).image;
    if (!arguments.truth.empty()) {
      WriteExr(arguments.truth, {truth});
    }
    options = {};
    options.thread_count = arguments.thread_count;
  }
  options.integrator = arguments.integrator;
  options.sampling = arguments.sampling;
  std::vector<Row> rows;
  std::printf(
      "| spp | CPU-s | before paths | relative L2 | lit points | questions | pairs "
      "|\n");
  std::printf("|---|---|---|---|---|---|---|\n");
  for (const int spp : arguments.spp) {
    options.spp = spp;
    const Rendering made = Render(scene, options);
    const RenderSummary& summary = made.summary;
    const double before =
        summary.build_s + summary.seen_s + summary.irradiance_s + summary.models_s;
    rows.push_back({summary.cpu_s, RelativeL2(made.image, truth)});
    std::printf("| %d | %.1f | %.1f | %.2f %% | %lld | %lld | %lld |\n",
                spp,
                summary.cpu_s,
                before,
                100 * rows.back().error,
                static_cast<long long>(summary.lit_points),
                static_cast<long long>(summary.evaluations),
                static_cast<long long>(summary.pairs));
    std::fflush(stdout);
  }
  PrintTimeTo(rows, 0.02);
  PrintTimeTo(rows, 0.01);
}

}  // namespace
}  // namespace nacre::render

int main(int argc, char** argv) {
  nacre::render::Arguments arguments;
  CLI::App app("run time against error");
  app.add_option("scene", arguments.scene)->required();
  app.add_option("--truth", arguments.truth);
  app.add_option("--truth-spp", arguments.truth_spp);
  app.add_option("--integrator", arguments.integrator);
  app.add_option("--spp", arguments.spp)->delimiter(',');
  app.add_option("--threads", arguments.thread_count);
  app.add_option("--sampling", arguments.sampling);
  app.add_option("-D", arguments.defines)->allow_extra_args(false);
  return nacre::render::RunTool(
      app, argc, argv, [&] { nacre::render::Run(arguments); });
}

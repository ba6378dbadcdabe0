// `fast` against `reference`, its noise told apart from its bias:
//
//   render_right SCENE.xml … [--fast-spp N] [--reference-spp N] [--threads N]
//                [-D name=value …] [--out FOLDER] [--spacing S] [--points P]
//                [--everywhere]
//
// Each scene is rendered four times, twice each way with different seeds; a line each
// says by how much the two ways' means differ, how much of that their noise explains,
// and the bias that is left with its upper bound (tests/render/bias.h). With --out the
// mean pictures are kept as NAME-fast.exr and NAME-reference.exr.

#include "render/render.h"
#include "tests/render/bias.h"

#include <cstdio>
#include <filesystem>

#include "bench/render/scene_tool.h"

namespace nacre::render {
namespace {

struct Arguments {
  std::vector<std::string> scenes;
  std::string out;
  int fast_spp = 64;
  int reference_spp = 1024;
  int thread_count = 1;
  double spacing = 1;  ///< exitance_spacing, points_per_patch and not lazy, of fast
  double points = 16;
  bool everywhere = false;
  std::vector<std::string> defines;
};

ExrPart Mean(ExrPart a, const ExrPart& b) {
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    a.values[i] = 0.5F * (a.values[i] + b.values[i]);
  }
  return a;
}

void Run(const Arguments& arguments) {
  std::printf(
      "| scene | fast | reference | difference | of it noise | bias | at most |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const std::string& path : arguments.scenes) {
    const Scene scene = ReadDefined(path, arguments.defines);
    double fast_s = 0;
    double reference_s = 0;
    const auto render =
        [&](const char* integrator, int spp, std::uint64_t seed, double& cpu_s) {
          RenderOptions options;
          options.integrator = integrator;
          options.spp = spp;
          options.seed = seed;
          options.thread_count = arguments.thread_count;
          options.exitance_spacing = arguments.spacing;
          options.points_per_patch = arguments.points;
          options.lazy = !arguments.everywhere;
          Rendering made = Render(scene, options);
          cpu_s += made.summary.cpu_s;
          return made.image;
        };
    const ExrPart a1 = render("fast", arguments.fast_spp, 1, fast_s);
    const ExrPart a2 = render("fast", arguments.fast_spp, 2, fast_s);
    const ExrPart b1 = render("reference", arguments.reference_spp, 3, reference_s);
    const ExrPart b2 = render("reference", arguments.reference_spp, 4, reference_s);
    const Difference d = Compare(a1, a2, b1, b2);
    const std::string name = std::filesystem::path(path).stem().string();
    std::printf(
        "| %s | 2 x %d, %.1f CPU-s | 2 x %d, %.1f CPU-s | %.2f %% | %.2f %% | %.2f %% "
        "| %.2f %% |\n",
        name.c_str(),
        arguments.fast_spp,
        fast_s,
        arguments.reference_spp,
        reference_s,
        100 * d.total,
        100 * d.noise,
        100 * d.bias,
        100 * d.bound);
    std::fflush(stdout);
    if (!arguments.out.empty()) {
      const std::filesystem::path folder(arguments.out);
      WriteExr(folder / (name + "-fast.exr"), {Mean(a1, a2)});
      WriteExr(folder / (name + "-reference.exr"), {Mean(b1, b2)});
    }
  }
}

}  // namespace
}  // namespace nacre::render

int main(int argc, char** argv) {
  nacre::render::Arguments arguments;
  CLI::App app("fast against reference");
  app.add_option("scenes", arguments.scenes)->required();
  app.add_option("--fast-spp", arguments.fast_spp);
  app.add_option("--reference-spp", arguments.reference_spp);
  app.add_option("--threads", arguments.thread_count);
  app.add_option("--spacing", arguments.spacing);
  app.add_option("--points", arguments.points);
  app.add_flag("--everywhere", arguments.everywhere);
  app.add_option("--out", arguments.out);
  app.add_option("-D", arguments.defines)->allow_extra_args(false);
  return nacre::render::RunTool(
      app, argc, argv, [&] { nacre::render::Run(arguments); });
}

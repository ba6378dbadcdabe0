// nacre factor: a dataset to a material.

#include "factor/factor.h"

#include "cli/command_line.h"
#include "core/json.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct Arguments {
  std::filesystem::path dataset;
  std::filesystem::path out;
  factor::FactorOptions options;
};

std::string Text(const factor::FactorSummary& summary,
                 const factor::Material& material,
                 const std::filesystem::path& out) {
  std::string text = out.string() + ": " + summary.Brief();
  for (std::size_t c = 0; c < summary.a.size(); ++c) {
    text += fmt::format("\n  {}: A = {:.4g} mm^-2", material.channels[c], summary.a[c]);
    if (c < summary.b.size()) {  // only logarithms with an offset have it
      text += fmt::format(", B = {:.4g}", summary.b[c]);
    }
  }
  if (summary.bits < 32) {
    text += fmt::format(
        "\n  rounded to {} bits, which adds {:.2g} % to the error and {:.2g} % to the "
        "log error",
        summary.bits,
        100 * summary.added_l2,
        100 * summary.added_log);
  }
  text += fmt::format(
      "\n  worst slice ({}, {}): {:.3g} %; slice totals within {:.1e}; {} passes over "
      "the "
      "data",
      summary.worst_slice_i,
      summary.worst_slice_j,
      100 * summary.worst_slice,
      summary.worst_total,
      summary.passes);
  text += "\n  " + summary.invariants.Brief();
  return text;
}

int Run(Arguments& arguments, const Common& common) {
  arguments.options.thread_count = common.thread_count;
  arguments.options.seed = common.seed;
  reconstruct::RdReader reader(arguments.dataset);
  const auto [material, summary] =
      factor::Factor(reader, arguments.options, ConsoleProgress(common));
  factor::WriteMaterial(arguments.out, material);
  for (const std::string& note : summary.notes) {
    Say(common, "note: " + note);
  }
  Json json = summary.ToJson();
  json["method"] = material.method;
  json["channels"] = material.channels;
  json["out"] = arguments.out.string();
  Print(common, json, Text(summary, material, arguments.out));
  return 0;
}

}  // namespace

std::function<int()> MakeFactorVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<Arguments>();
  app.add_option("dataset", arguments->dataset, "R_d, *.rd.exr")->required();
  app.add_option("--out", arguments->out, "the material, *.nacre.exr")->required();
  AddOptions(app, arguments->options);
  app.get_option("--bytes")->transform(CLI::AsSizeValue(true));  // 300k, 2MB
  return [arguments, &common] { return Run(*arguments, common); };
}

}  // namespace nacre::cli

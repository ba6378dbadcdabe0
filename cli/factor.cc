// nacre factor: a dataset to a material.

#include "factor/factor.h"

#include "cli/command_line.h"
#include "core/json.h"
#include "core/options_json.h"
#include "core/ranks.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

namespace nacre::cli {
namespace {

struct FactorArguments {
  std::filesystem::path dataset;
  std::filesystem::path out;
  std::filesystem::path reuse;
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

// The options of a material but for those that are given.
factor::FactorOptions Changed(const factor::Material& made,
                              const factor::FactorOptions& parsed,
                              const CLI::App& app) {
  factor::FactorOptions options = factor::OptionsOf(made);
  const Json given = OptionsToJson(parsed);
  factor::FactorOptions::Visit(
      options, [&](const char* name, auto& value, Range, const char*) {
        std::string flag = std::string("--") + name;
        std::replace(flag.begin(), flag.end(), '_', '-');
        if (app.count(flag) > 0) {
          value = given[name].get<std::remove_cvref_t<decltype(value)>>();
        }
      });
  return options;
}

// What is to be done, and with what to begin.
struct FactorPlan {
  factor::FactorOptions options;
  std::optional<factor::Material> made;
};

FactorPlan MakePlan(const CLI::App& app,
                    const FactorArguments& arguments,
                    const Common& common) {
  FactorPlan plan{arguments.options, {}};
  plan.options.seed = common.seed;
  if (!arguments.reuse.empty()) {
    plan.made = factor::ReadMaterial(arguments.reuse);
    plan.options = Changed(*plan.made, plan.options, app);
  }
  plan.options.thread_count = common.thread_count;
  if (common.ranks != nullptr && common.ranks->size() > 1) {
    plan.options.ranks = common.ranks;
  }
  return plan;
}

int Run(const CLI::App& app, const FactorArguments& arguments, const Common& common) {
  const FactorPlan plan = MakePlan(app, arguments, common);
  reconstruct::RdReader reader(arguments.dataset);
  const ProgressFunction progress = ConsoleProgress(common);
  const auto [material, summary] =
      plan.made ? factor::FactorAgain(*plan.made, reader, plan.options, progress)
                : factor::Factor(reader, plan.options, progress);
  if (!common.IsRoot()) {
    return 0;
  }
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
  auto arguments = std::make_shared<FactorArguments>();
  app.add_option("dataset", arguments->dataset, "R_d, *.rd.exr")->required();
  app.add_option("--out", arguments->out, "the material, *.nacre.exr")->required();
  app.add_option("--reuse",
                 arguments->reuse,
                 "a material of the same data to begin with: its options (seed, too) "
                 "are those not given here, and what a changed one leaves of it isn't "
                 "done again: of the SVDs, fewer terms are its first; notes tell");
  AddOptions(app, arguments->options);
  app.get_option("--bytes")->transform(CLI::AsSizeValue(true));  // 300k, 2MB
  return [arguments, &app, &common] { return Run(app, *arguments, common); };
}

}  // namespace nacre::cli

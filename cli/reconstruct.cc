// nacre reconstruct: a session to a dataset, R_d in mm^-2.

#include "reconstruct/reconstruct.h"

#include "cli/command_line.h"

#include <memory>

namespace nacre::cli {
namespace {

struct ReconstructArguments {
  std::filesystem::path session;
  std::filesystem::path calibration;
  std::filesystem::path out;
  std::uint64_t memory_bytes = 512'000'000;
  reconstruct::ReconstructOptions options;
};

int Run(const ReconstructArguments& args, const Common& common) {
  reconstruct::ReconstructOptions options = args.options;
  options.memory_bytes = static_cast<double>(args.memory_bytes);
  options.thread_count = common.thread_count;
  options.ranks = common.ranks;
  const acquire::SessionReader session(args.session);
  const reconstruct::ReconstructSummary summary =
      reconstruct::Reconstruct(session,
                               calibrate::ReadCalibration(args.calibration),
                               args.out,
                               options,
                               ConsoleProgress(common));
  Say(common, "reconstructed " + args.session.string() + ": " + summary.Brief());
  for (const std::string& warning : summary.warnings) {
    Say(common, "warning: " + warning);
  }
  Print(common,
        Json{{"file", args.out.string()},
             {"warnings", summary.warnings},
             {"slices", summary.slice_count},
             {"frames", summary.frame_count},
             {"saturated_pixels", summary.saturated_count},
             {"invalid_values", summary.invalid_count},
             {"below_glare_floor", summary.below_floor_count},
             {"max_crosstalk", summary.max_crosstalk},
             {"windows_overlap", summary.is_dense},
             {"tail_spread", summary.tail_spread},
             {"groups", summary.group_count},
             {"groups_reused", summary.groups_reused},
             {"groups_missing", summary.groups_missing},
             {"reciprocity",
              {{"pairs", summary.reciprocity.pair_count},
               {"difference", summary.reciprocity.difference},
               {"noise", summary.reciprocity.noise},
               {"asymmetry", summary.reciprocity.asymmetry}}},
             {"symmetrize_change", summary.symmetrize_change},
             {"symmetrize_worst_total", summary.symmetrize_worst_total},
             {"spot_sigma_mm", summary.spot_sigma_mm},
             {"threads", summary.thread_count_used},
             {"seconds", summary.seconds}},
        args.out.string());
  return 0;
}

}  // namespace

std::function<int()> MakeReconstructVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<ReconstructArguments>();
  app.add_option("session", args->session, "folder of a complete session")->required();
  app.add_option("--calibration", args->calibration, "calibration.json of that session")
      ->required();
  app.add_option("-o,--out", args->out, "dataset to write, *.rd.exr")->required();
  app.add_option("--memory", args->memory_bytes, "for frames under way, e.g. 512MB")
      ->transform(CLI::AsSizeValue(true))
      ->default_str("512MB");
  app.add_flag(
      "--incremental",
      args->options.incremental,
      "take a session that isn't complete, and go on from OUT.work of the last "
      "run: only new pictures are read");
  app.add_option("--max-age-days",
                 args->options.max_age_days,
                 "warn if the calibration was captured that long before or after")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  AddOptions(app, args->options);
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli

#include "calibrate/calibrate.h"

#include "calibrate/session_state.h"
#include "cli/command_line.h"
#include "core/error.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct CalibrateArguments {
  std::filesystem::path session;
  std::filesystem::path out;
  std::filesystem::path check;
  double max_age_days = calibrate::kMaxAgeDays;
  calibrate::CalibrateOptions options;
};

Json ToJson(const std::vector<calibrate::Warning>& warnings) {
  Json list = Json::array();
  for (const calibrate::Warning& warning : warnings) {
    list.push_back({{"name", warning.name}, {"text", warning.text}});
  }
  return list;
}

std::string ToText(const std::vector<calibrate::Warning>& warnings) {
  std::string text;
  for (const calibrate::Warning& warning : warnings) {
    text += fmt::format("\nwarning: {}: {}", warning.name, warning.text);
  }
  return text;
}

// Is that calibration still true of the session, and what does its sample say?
int CheckCalibration(const acquire::SessionReader& session,
                     const CalibrateArguments& arguments,
                     const Common& common) {
  const calibrate::Calibration calibration =
      calibrate::ReadCalibration(arguments.check);
  std::vector<calibrate::Warning> warnings =
      calibrate::CompareWithSession(session, calibration, arguments.max_age_days);
  const calibrate::SessionState state =
      calibrate::ExamineSession(session, calibration, ConsoleProgress(common));
  const std::size_t stale = warnings.size();
  warnings.insert(warnings.end(), state.warnings.begin(), state.warnings.end());
  Print(common,
        Json{{"stale", stale > 0},
             {"warnings", ToJson(warnings)},
             {"drift_per_hour", state.drift_per_hour},
             {"drift_sigma_per_hour", state.drift_sigma_per_hour},
             {"sample_height_mm", state.plane.height_mm},
             {"sample_height_sigma_mm", state.plane.height_sigma_mm},
             {"sample_slope_x", state.plane.slope_x},
             {"sample_slope_y", state.plane.slope_y}},
        (stale > 0 ? "the calibration is stale" : "the calibration holds") +
            ToText(warnings));
  return 0;
}

Json ToJson(const calibrate::Calibration& calibration) {
  Json channels = Json::array();
  for (const calibrate::ChannelResponse& channel : calibration.channels) {
    channels.push_back(
        {{"name", channel.name},
         {"flux_scale_counts_mm2_sr_per_us", channel.flux_scale_counts_mm2_sr_per_us},
         {"flux_scale_spread", channel.flux_scale_spread},
         {"flux_scale_sigma", channel.flux_scale_sigma}});
  }
  return Json{{"reprojection_rms_px", calibration.reprojection_rms_px},
              {"laser_map_rms_mm", calibration.laser_map_rms_mm},
              {"laser_map_max_mm", calibration.laser_map_max_mm},
              {"gain_electrons_per_count", calibration.gain_electrons_per_count},
              {"read_noise_electrons", calibration.read_noise_electrons},
              {"dark_offset_counts", calibration.dark.offset_counts},
              {"dark_rate_counts_per_us", calibration.dark.rate_counts_per_us},
              {"saturation_counts", calibration.saturation_counts},
              {"laser_map_held_out_rms_mm", calibration.laser_map_held_out_rms_mm},
              {"glare_fraction", calibration.corrections.glare.fraction},
              {"hot_pixels", calibration.corrections.hot_pixels.size()},
              {"warnings", ToJson(calibration.corrections.warnings)},
              {"channels", channels}};
}

std::string ToText(const calibrate::Calibration& calibration) {
  std::string text = fmt::format(
      "camera      {:.3f} px rms reprojection, f = {:.1f} px\n"
      "laser map   {:.4f} mm rms, {:.4f} mm at worst, {:.4f} mm rms held out\n"
      "gain        {:.3f} +- {:.3f} electrons a count, read noise {:.2f} electrons\n"
      "dark        {:.3f} counts + {:.3g} counts/us, saturated at {:.0f} counts",
      calibration.reprojection_rms_px,
      calibration.camera.fx_px,
      calibration.laser_map_rms_mm,
      calibration.laser_map_max_mm,
      calibration.laser_map_held_out_rms_mm,
      calibration.gain_electrons_per_count,
      calibration.gain_sigma_electrons_per_count,
      calibration.read_noise_electrons,
      calibration.dark.offset_counts,
      calibration.dark.rate_counts_per_us,
      calibration.saturation_counts);
  for (const calibrate::ChannelResponse& channel : calibration.channels) {
    text += fmt::format(
        "\nflux {:<6} {:.5g} counts mm^2 sr/us +- {:.2f} %, {:.2f} % over spots",
        channel.name,
        channel.flux_scale_counts_mm2_sr_per_us,
        100 * channel.flux_scale_sigma,
        100 * channel.flux_scale_spread);
  }
  return text + ToText(calibration.corrections.warnings);
}

}  // namespace

std::function<int()> MakeCalibrateVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<CalibrateArguments>();
  app.add_option("session", arguments->session, "session folder, from nacre capture")
      ->required();
  app.add_option("--out", arguments->out, "calibration to write, *.json");
  app.add_option("--check",
                 arguments->check,
                 "an earlier calibration: say whether it is still true of the session");
  app.add_option("--max-age-days",
                 arguments->max_age_days,
                 "with --check: how far apart both may have been captured")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  AddOptions(app, arguments->options);
  return [arguments, &common] {
    if (arguments->out.empty() == arguments->check.empty()) {
      throw UsageError(
          "calibrate needs one of --out CALIBRATION.json and --check CALIBRATION.json");
    }
    const acquire::SessionReader session(arguments->session);
    if (!arguments->check.empty()) {
      return CheckCalibration(session, *arguments, common);
    }
    const calibrate::Calibration calibration =
        calibrate::Calibrate(session, arguments->options, ConsoleProgress(common));
    calibrate::WriteCalibration(arguments->out, calibration);
    Print(common, ToJson(calibration), ToText(calibration));
    Say(common, "wrote " + arguments->out.string());
    return 0;
  };
}

}  // namespace nacre::cli

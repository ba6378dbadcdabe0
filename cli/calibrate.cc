#include "calibrate/calibrate.h"

#include "cli/command_line.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct Arguments {
  std::filesystem::path session;
  std::filesystem::path out;
  calibrate::CalibrateOptions options;
};

Json ToJson(const calibrate::Calibration& calibration) {
  Json channels = Json::array();
  for (const calibrate::ChannelResponse& channel : calibration.channels) {
    channels.push_back(
        {{"name", channel.name},
         {"flux_scale_counts_mm2_sr_per_us", channel.flux_scale_counts_mm2_sr_per_us},
         {"flux_scale_spread", channel.flux_scale_spread}});
  }
  return Json{{"reprojection_rms_px", calibration.reprojection_rms_px},
              {"laser_map_rms_mm", calibration.laser_map_rms_mm},
              {"laser_map_max_mm", calibration.laser_map_max_mm},
              {"gain_electrons_per_count", calibration.gain_electrons_per_count},
              {"read_noise_electrons", calibration.read_noise_electrons},
              {"dark_offset_counts", calibration.dark.offset_counts},
              {"dark_rate_counts_per_us", calibration.dark.rate_counts_per_us},
              {"saturation_counts", calibration.saturation_counts},
              {"channels", channels}};
}

std::string ToText(const calibrate::Calibration& calibration) {
  std::string text = fmt::format(
      "camera      {:.3f} px rms reprojection, f = {:.1f} px\n"
      "laser map   {:.4f} mm rms, {:.4f} mm at worst\n"
      "gain        {:.3f} electrons a count, read noise {:.2f} electrons\n"
      "dark        {:.3f} counts + {:.3g} counts/us, saturated at {:.0f} counts",
      calibration.reprojection_rms_px,
      calibration.camera.fx_px,
      calibration.laser_map_rms_mm,
      calibration.laser_map_max_mm,
      calibration.gain_electrons_per_count,
      calibration.read_noise_electrons,
      calibration.dark.offset_counts,
      calibration.dark.rate_counts_per_us,
      calibration.saturation_counts);
  for (const calibrate::ChannelResponse& channel : calibration.channels) {
    text += fmt::format("\nflux {:<6} {:.5g} counts mm^2 sr/us, +- {:.2f} % over spots",
                        channel.name,
                        channel.flux_scale_counts_mm2_sr_per_us,
                        100 * channel.flux_scale_spread);
  }
  return text;
}

}  // namespace

std::function<int()> MakeCalibrateVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<Arguments>();
  app.add_option("session", arguments->session, "session folder, from nacre capture")
      ->required();
  app.add_option("--out", arguments->out, "calibration to write, *.json")->required();
  AddOptions(app, arguments->options);
  return [arguments, &common] {
    const acquire::SessionReader session(arguments->session);
    const calibrate::Calibration calibration =
        calibrate::Calibrate(session, arguments->options, ConsoleProgress(common));
    calibrate::WriteCalibration(arguments->out, calibration);
    Print(common, ToJson(calibration), ToText(calibration));
    Say(common, "wrote " + arguments->out.string());
    return 0;
  };
}

}  // namespace nacre::cli

#include "calibrate/laser_map.h"
#include "calibrate/radiometry.h"
#include "calibrate/session_state.h"

#include <cmath>
#include <fmt/format.h>

namespace nacre::calibrate {
namespace {

void CompareDark(const Calibration& calibration,
                 const DarkResult& now,
                 double exposure_us,
                 std::vector<Warning>& warnings) {
  const double off =
      now.level.Counts(exposure_us) - calibration.dark.Counts(exposure_us);
  const double sigma = std::hypot(
      std::hypot(now.level.offset_sigma_counts, calibration.dark.offset_sigma_counts),
      exposure_us * std::hypot(now.level.rate_sigma_counts_per_us,
                               calibration.dark.rate_sigma_counts_per_us));
  constexpr double kMattersCounts = 0.25;
  if (std::abs(off) > std::max(kMattersCounts, 5 * sigma)) {
    warnings.push_back(
        {"stale-dark",
         fmt::format("the dark level of the longest exposure is {:+.2f} "
                     "counts off the calibration's; was the camera warm?",
                     off)});
  }
  const auto known = std::ssize(calibration.corrections.hot_pixels);
  const auto found = std::ssize(now.hot_pixels);
  if (found > 2 * known + 10) {
    warnings.push_back(
        {"stale-hot-pixels",
         fmt::format("{} pixels are hot, {} when it was calibrated", found, known)});
  }
}

void CompareGeometry(const Calibration& calibration,
                     const LaserMapResult& now,
                     double pitch_mm,
                     std::vector<Warning>& warnings) {
  double x = 0;
  double y = 0;
  double square = 0;
  const auto n = static_cast<double>(now.residuals.size());
  for (const SpotResidual& residual : now.residuals) {
    const acquire::ScanAngle angle = now.map.AngleFromSample(residual.at);
    const PointMm then = calibration.scan_map.SampleFromAngle(angle);
    const double dx = residual.at.x - then.x;
    const double dy = residual.at.y - then.y;
    x += dx / n;
    y += dy / n;
    square += (dx * dx + dy * dy) / n;
  }
  const double off_mm = std::sqrt(square);
  const double expected =
      std::hypot(now.held_out_rms_mm, calibration.laser_map_held_out_rms_mm);
  constexpr double kMattersPitch = 0.02;
  if (off_mm > std::max(kMattersPitch * pitch_mm, 3 * expected)) {
    warnings.push_back(
        {"stale-geometry",
         fmt::format("the lattice on the reference is {:.3f} mm rms off where it was "
                     "(on the average {:+.3f}, {:+.3f}): camera or laser have moved",
                     off_mm,
                     x,
                     y)});
  }
}

void CompareFlux(const Calibration& calibration,
                 const FluxResult& now,
                 std::vector<Warning>& warnings) {
  for (std::size_t c = 0; c < now.channels.size(); ++c) {
    const ChannelResponse& then = calibration.channels[c];
    const double ratio = now.channels[c].flux_scale_counts_mm2_sr_per_us /
                         then.flux_scale_counts_mm2_sr_per_us;
    const double sigma =
        std::hypot(now.channels[c].flux_scale_sigma, then.flux_scale_sigma);
    constexpr double kMatters = 0.01;
    if (std::abs(ratio - 1) > std::max(kMatters, 4 * sigma)) {
      warnings.push_back({"stale-flux",
                          fmt::format("channel {} gives {:.3f} of the flux that was "
                                      "calibrated",
                                      then.name,
                                      ratio)});
    }
  }
}

}  // namespace

std::vector<Warning> CompareAge(const acquire::SessionReader& session,
                                const Calibration& calibration,
                                double max_age_days) {
  const std::optional<std::int64_t> then = calibration.captured_unix_s;
  const std::optional<std::int64_t> now = session.manifest().captured_unix_s;
  if (!then || !now) {
    return {};
  }
  constexpr double kSecondsADay = 86400;
  const double days = static_cast<double>(*now - *then) / kSecondsADay;
  if (std::abs(days) <= max_age_days) {
    return {};
  }
  return {{"stale-by-age",
           fmt::format("the calibration's pictures were taken {:.1f} days {} the "
                       "session's, more than {:g} apart; check it against the "
                       "session's own targets (nacre calibrate --check)",
                       std::abs(days),
                       days > 0 ? "before" : "after",
                       max_age_days)}};
}

std::vector<Warning> CompareWithSession(const acquire::SessionReader& session,
                                        const Calibration& calibration,
                                        double max_age_days) {
  std::vector<Warning> warnings = CompareAge(session, calibration, max_age_days);
  const acquire::CameraInfo& camera = session.manifest().camera;
  if (camera.width != calibration.camera.width_px ||
      camera.height != calibration.camera.height_px ||
      camera.mosaic != calibration.corrections.filters.mosaic ||
      session.rig().ChannelCount() != static_cast<int>(calibration.channels.size())) {
    warnings.push_back({"other-rig",
                        "the session's camera or laser isn't the one that was "
                        "calibrated"});
    return warnings;
  }
  const DarkResult dark = EstimateDarkMaps(session);
  CompareDark(calibration, dark, session.rig().camera.exposures_us.front(), warnings);
  const Corrections& corrections = calibration.corrections;
  RatePictures pictures(dark, corrections.linearity, corrections.filters);
  pictures.SetAmbient(
      EstimateAmbient(session, dark, corrections.linearity, corrections.filters, 0),
      camera.width,
      camera.height);
  const LaserMapResult laser = EstimateLaserMap(session, calibration.camera, pictures);
  CompareGeometry(calibration, laser, session.rig().grid.pitch_mm, warnings);
  pictures.SetGlare(corrections.glare, camera.width, camera.height);
  pictures.SetFlatField(corrections.flat_field, camera.width, camera.height);
  const PhotonTransfer transfer{
      .gain_electrons_per_count = calibration.gain_electrons_per_count,
      .saturation_counts = calibration.saturation_counts};
  CompareFlux(
      calibration,
      EstimateFluxScales(session, calibration.camera, laser.map, pictures, transfer),
      warnings);
  return warnings;
}

}  // namespace nacre::calibrate

#include "calibrate/internal/power_drift.h"

#include "calibrate/internal/disc_sum.h"
#include "calibrate/internal/pictures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::calibrate::internal {
namespace {

// The mean time of the pictures that the flux scale is from, hours.
double ReferenceHours(const acquire::SessionReader& session) {
  double sum = 0;
  const auto numbers = PicturesOf(session, acquire::Target::kReference);
  for (const std::int64_t number : numbers) {
    sum += static_cast<double>(session.Entry(number).timestamp_ns) / 3.6e12;
  }
  return sum / static_cast<double>(numbers.size());
}

}  // namespace

std::optional<PatchSample> LookAtPatch(const acquire::SessionReader& session,
                                       const Calibration& calibration,
                                       const acquire::Frame& frame,
                                       const std::vector<float>& rates,
                                       std::int64_t number) {
  const acquire::TargetsDescription& targets = session.rig().targets;
  constexpr double kRadiusPx = 4.5;
  const double pixel_mm2 = calibration.camera.FootprintMm2(
      calibration.camera.PixelFromSample(*targets.patch_mm));
  const Disc disc = SumDisc(frame,
                            rates,
                            calibration,
                            calibration.camera.PixelFromSample(*targets.patch_mm),
                            kRadiusPx);
  if (!disc.is_whole) {
    return std::nullopt;
  }
  const auto channel = static_cast<std::size_t>(session.schedule()[number].channel);
  double share = 1;
  if (channel < calibration.corrections.spots.size()) {
    const SpotProfile& spot = calibration.corrections.spots[channel];
    const double sigma_mm =
        std::sqrt(0.5 * std::max(0.0, spot.xx_mm2 + spot.yy_mm2) + pixel_mm2 / 12);
    share = DiscShare(kRadiusPx, sigma_mm / std::sqrt(pixel_mm2));
  }
  return PatchSample{
      .hours = static_cast<double>(session.Entry(number).timestamp_ns) / 3.6e12,
      .flux = disc.sum / share * std::numbers::pi / targets.patch_reflectance /
              calibration.channels[channel].flux_scale_counts_mm2_sr_per_us};
}

void FitDrift(const acquire::SessionReader& session,
              const std::vector<PatchSample>& samples,
              SessionState& state) {
  constexpr std::size_t kFewest = 8;
  if (samples.size() < kFewest) {
    return;
  }
  const double zero = ReferenceHours(session);
  const auto n = static_cast<double>(samples.size());
  double st = 0;
  double sf = 0;
  double stt = 0;
  double stf = 0;
  for (const PatchSample& s : samples) {
    const double t = s.hours - zero;
    st += t / n;
    sf += s.flux / n;
    stt += t * t / n;
    stf += t * s.flux / n;
  }
  const double spread = stt - st * st;
  if (!(spread > 0)) {
    return;
  }
  const double slope = (stf - st * sf) / spread;
  const double offset = sf - slope * st;
  double square = 0;
  for (const PatchSample& s : samples) {
    const double off = s.flux - offset - slope * (s.hours - zero);
    square += off * off / (n - 2);
  }
  state.has_patch = true;
  state.patch_flux = offset;
  state.drift_per_hour = slope / offset;
  state.drift_sigma_per_hour = std::sqrt(square / (n * spread)) / offset;
  for (std::size_t k = 0; k < state.relative_flux.size(); ++k) {
    const auto number = static_cast<std::int64_t>(k);
    if (number >= session.schedule().grid_begin() && session.WasTaken(number)) {
      const double t =
          static_cast<double>(session.Entry(number).timestamp_ns) / 3.6e12 - zero;
      state.relative_flux[k] = 1 + state.drift_per_hour * t;
    }
  }
}

}  // namespace nacre::calibrate::internal

#include "reconstruct/internal/spot_width.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace nacre::reconstruct::internal {
namespace {

// A disc of pixels around a spot: wide enough for the tails of a spot of one or two
// pixels, narrow enough that the dark level's error weighs nothing.
constexpr int kReachPx = 6;

// Σ w, and first and second moments about `about`, of the light in the disc.
struct Moments {
  double sum = 0;
  double x = 0;
  double y = 0;
  double square = 0;
};

Moments MomentsAround(const acquire::Frame& frame,
                      const calibrate::Calibration& calibration,
                      calibrate::PixelPoint centre,
                      PointMm about) {
  const double dark_counts = calibration.dark.Counts(frame.exposure_us);
  Moments moments;
  const int middle_x = static_cast<int>(std::lround(centre.x));
  const int middle_y = static_cast<int>(std::lround(centre.y));
  for (int y = middle_y - kReachPx; y <= middle_y + kReachPx; ++y) {
    for (int x = middle_x - kReachPx; x <= middle_x + kReachPx; ++x) {
      if (x < 0 || x >= frame.width || y < 0 || y >= frame.height) {
        return {};
      }
      const PointMm p = calibration.camera.SampleFromPixel(
          {static_cast<double>(x), static_cast<double>(y)});
      const std::size_t k =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
          static_cast<std::size_t>(x);
      const double weight = frame.counts[k] - dark_counts;
      const double dx = p.x - about.x;
      const double dy = p.y - about.y;
      moments.sum += weight;
      moments.x += weight * dx;
      moments.y += weight * dy;
      moments.square += weight * (dx * dx + dy * dy);
    }
  }
  return moments;
}

}  // namespace

double MeasureSpotSigmaMm(const acquire::SessionReader& session,
                          const calibrate::Calibration& calibration) {
  const acquire::Schedule& schedule = session.schedule();
  std::vector<double> variances_mm2;
  for (std::int64_t number = 0; number < schedule.grid_begin(); ++number) {
    if (schedule[number].target != acquire::Target::kReference) {
      continue;
    }
    const acquire::Frame frame = session.ReadFrame(number);
    for (const acquire::ScanAngle& angle : schedule.lattice()) {
      const PointMm spot = calibration.scan_map.SampleFromAngle(angle);
      const calibrate::PixelPoint pixel = calibration.camera.PixelFromSample(spot);
      const Moments m = MomentsAround(frame, calibration, pixel, spot);
      if (m.sum > 0) {
        const double x = m.x / m.sum;
        const double y = m.y / m.sum;
        // A pixel is a box: a twelfth of its area along each axis is not the spot's.
        variances_mm2.push_back(0.5 * (m.square / m.sum - x * x - y * y) -
                                calibration.camera.FootprintMm2(pixel) / 12);
      }
    }
  }
  if (variances_mm2.empty()) {
    throw BadData(session.folder().string() +
                  ": no laser spot can be made out on the reference target");
  }
  const auto middle = variances_mm2.begin() + std::ssize(variances_mm2) / 2;
  std::nth_element(variances_mm2.begin(), middle, variances_mm2.end());
  return std::sqrt(std::max(0.0, *middle));
}

calibrate::SpotProfile SpotOf(const acquire::SessionReader& session,
                              const calibrate::Calibration& calibration) {
  const auto& spots = calibration.corrections.spots;
  calibrate::SpotProfile mean;
  if (spots.empty()) {
    const double sigma_mm = MeasureSpotSigmaMm(session, calibration);
    mean.xx_mm2 = mean.yy_mm2 = sigma_mm * sigma_mm;
  }
  for (const calibrate::SpotProfile& spot : spots) {
    const auto count = static_cast<double>(spots.size());
    mean.xx_mm2 += spot.xx_mm2 / count;
    mean.xy_mm2 += spot.xy_mm2 / count;
    mean.yy_mm2 += spot.yy_mm2 / count;
  }
  return mean;
}

}  // namespace nacre::reconstruct::internal

#include "calibrate/internal/disc_sum.h"

#include <cmath>
#include <cstdint>

namespace nacre::calibrate::internal {

namespace {

constexpr double kRingPx = 1.5;  // width of the ring

// Pixels within `reach` columns and rows of one.
struct PixelSquare {
  int width;
  int x0;
  int y0;
  int reach;

  template <class Use>
  void ForEach(Use&& use) const {
    for (int y = y0 - reach; y <= y0 + reach; ++y) {
      for (int x = x0 - reach; x <= x0 + reach; ++x) {
        use(x, y, static_cast<std::size_t>(std::int64_t{y} * width + x));
      }
    }
  }
};

}  // namespace

double DiscShare(double radius_px, double spot_sigma_px) {
  const double outer = radius_px + kRingPx;
  const double two_sigma2 = 2 * spot_sigma_px * spot_sigma_px;
  const double beyond = std::exp(-radius_px * radius_px / two_sigma2);
  const double on_ring = beyond - std::exp(-outer * outer / two_sigma2);
  const double areas = radius_px * radius_px / (outer * outer - radius_px * radius_px);
  return 1 - beyond - on_ring * areas;
}

Disc SumDisc(const acquire::Frame& frame,
             const std::vector<float>& rates,
             const Calibration& calibration,
             PixelPoint about,
             double radius_px) {
  Disc disc;
  const int reach = static_cast<int>(std::ceil(radius_px)) + 2;
  const int x0 = static_cast<int>(std::lround(about.x));
  const int y0 = static_cast<int>(std::lround(about.y));
  if (x0 < reach || y0 < reach || x0 + reach >= frame.width ||
      y0 + reach >= frame.height) {
    return disc;
  }
  const PixelSquare square{frame.width, x0, y0, reach};
  std::vector<double> ring;
  square.ForEach([&](int x, int y, std::size_t k) {
    const double r = std::hypot(x - about.x, y - about.y);
    if (r > radius_px && r <= radius_px + kRingPx) {
      ring.push_back(static_cast<double>(rates[k]));
    }
  });
  double ground = 0;
  for (const double value : ring) {
    ground += value / static_cast<double>(ring.size());
  }
  double sum_x = 0;
  double sum_y = 0;
  double count = 0;
  bool is_saturated = false;
  square.ForEach([&](int x, int y, std::size_t k) {
    if (std::hypot(x - about.x, y - about.y) > radius_px) {
      return;
    }
    is_saturated = is_saturated || frame.counts[k] >= calibration.saturation_counts;
    const double light = static_cast<double>(rates[k]) - ground;
    disc.sum += light;
    sum_x += light * x;
    sum_y += light * y;
    count += 1;
  });
  if (is_saturated) {
    return {};
  }
  disc.is_whole = disc.sum > 0 && count > 0;
  if (disc.is_whole) {
    disc.centre = {sum_x / disc.sum, sum_y / disc.sum};
    disc.sum *= calibration.camera.FootprintMm2(about);
  }
  return disc;
}

std::optional<PixelPoint> PeakCentre(const acquire::Frame& frame,
                                     const std::vector<float>& rates,
                                     const Calibration& calibration,
                                     PixelPoint about) {
  constexpr double kRadiusPx = 3.5;
  constexpr int kRounds = 6;
  const PixelPoint start = about;
  for (int round = 0; round < kRounds; ++round) {
    const Disc disc = SumDisc(frame, rates, calibration, about, kRadiusPx);
    if (!disc.is_whole ||
        std::hypot(disc.centre.x - start.x, disc.centre.y - start.y) > 3 * kRadiusPx) {
      return std::nullopt;
    }
    about = disc.centre;
  }
  return about;
}

}  // namespace nacre::calibrate::internal

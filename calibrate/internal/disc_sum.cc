#include "calibrate/internal/disc_sum.h"

#include <cmath>

namespace nacre::calibrate::internal {

namespace {

constexpr double kRingPx = 1.5;  // width of the ring

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
  std::vector<double> ring;
  double sum_x = 0;
  double sum_y = 0;
  double count = 0;
  for (int pass = 0; pass < 2; ++pass) {
    double ground = 0;
    for (const double value : ring) {
      ground += value / static_cast<double>(ring.size());
    }
    for (int y = y0 - reach; y <= y0 + reach; ++y) {
      for (int x = x0 - reach; x <= x0 + reach; ++x) {
        const auto k = static_cast<std::size_t>(y * frame.width + x);
        const double r = std::hypot(x - about.x, y - about.y);
        const auto rate = static_cast<double>(rates[k]);
        if (pass == 0 && r > radius_px && r <= radius_px + kRingPx) {
          ring.push_back(rate);
        }
        if (pass == 1 && r <= radius_px) {
          if (frame.counts[k] >= calibration.saturation_counts) {
            return disc;
          }
          disc.sum += rate - ground;
          sum_x += (rate - ground) * x;
          sum_y += (rate - ground) * y;
          count += 1;
        }
      }
    }
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

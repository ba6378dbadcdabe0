#include "reconstruct/internal/spot_rings.h"

#include "acquire/mosaic.h"
#include "calibrate/mosaic.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// The sample plane around a pixel, straightened.
struct Patch {
  PointMm at;
  PointMm right;  // a pixel on
  PointMm down;

  Patch(const calibrate::CameraGeometry& camera, calibrate::PixelPoint pixel)
      : at(camera.SampleFromPixel(pixel)) {
    constexpr double kArm = 3;
    const auto slope = [&](double x, double y) {
      const PointMm ahead = camera.SampleFromPixel({pixel.x + x, pixel.y + y});
      const PointMm back = camera.SampleFromPixel({pixel.x - x, pixel.y - y});
      return PointMm{(ahead.x - back.x) / (2 * kArm), (ahead.y - back.y) / (2 * kArm)};
    };
    right = slope(kArm, 0);
    down = slope(0, kArm);
  }
};

}  // namespace

bool SpotRings::empty() const {
  return std::all_of(pixels.begin(), pixels.end(), [](float n) { return n == 0; });
}

void SpotRings::Add(const SpotRings& other) {
  for (std::size_t k = 0; k < kCount; ++k) {
    sum[k] += other.sum[k];
    pixels[k] += other.pixels[k];
    square_mm2[k] += other.square_mm2[k];
  }
}

double SpotRings::RadiusMm(std::size_t ring) const {
  return std::sqrt(static_cast<double>(square_mm2[ring] / pixels[ring]));
}

RingReader::RingReader(const calibrate::Calibration& calibration,
                       const calibrate::CameraGeometry& camera)
    : camera_(camera) {
  const calibrate::Corrections& corrections = calibration.corrections;
  const std::vector<float> flat =
      corrections.flat_field.Map(camera.width_px, camera.height_px);
  for (int c = 0; c < static_cast<int>(calibration.channels.size()); ++c) {
    // The colour that sees the laser best is enough.
    const auto shares = SharesOf(corrections.filters, c);
    const auto best = std::max_element(
        shares.begin(), shares.end(), [](const auto& a, const auto& b) {
          return a.weight < b.weight;
        });
    std::vector<float>& weight = weight_.emplace_back(flat.size(), 0.0F);
    for (std::size_t k = 0; k < flat.size(); ++k) {
      const int x = static_cast<int>(k) % camera.width_px;
      const int y = static_cast<int>(k) / camera.width_px;
      const bool sees =
          corrections.filters.mosaic.empty() ||
          acquire::ColourAt(corrections.filters.mosaic, x, y) == best->plane.colour;
      weight[k] = sees ? 1 / flat[k] : 0.0F;
    }
    for (const calibrate::HotPixel& pixel : corrections.hot_pixels) {
      weight[static_cast<std::size_t>(pixel.index)] = 0;
    }
  }
}

double RingReader::RingMm() const {
  return std::sqrt(
             camera_.FootprintMm2({0.5 * camera_.width_px, 0.5 * camera_.height_px})) /
         3;
}

SpotRings RingReader::Around(const RateFrame& rates,
                             int channel,
                             PointMm spot,
                             double ring_mm) const {
  const calibrate::PixelPoint centre = camera_.PixelFromSample(spot);
  const Patch patch(camera_, centre);
  const double pixel_mm =
      std::sqrt(std::abs(patch.right.x * patch.down.y - patch.right.y * patch.down.x));
  const int reach = static_cast<int>(ring_mm * SpotRings::kCount / pixel_mm) + 2;
  const int x0 = static_cast<int>(std::lround(centre.x));
  const int y0 = static_cast<int>(std::lround(centre.y));
  SpotRings rings;
  if (x0 < reach || y0 < reach || x0 + reach >= camera_.width_px ||
      y0 + reach >= camera_.height_px) {
    return rings;
  }
  const std::vector<float>& weight = weight_[static_cast<std::size_t>(channel)];
  for (int y = y0 - reach; y <= y0 + reach; ++y) {
    for (int x = x0 - reach; x <= x0 + reach; ++x) {
      const auto at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width_px) +
          static_cast<std::size_t>(x);
      const double u = x - centre.x;
      const double v = y - centre.y;
      const double r2 =
          std::pow(patch.at.x + u * patch.right.x + v * patch.down.x - spot.x, 2) +
          std::pow(patch.at.y + u * patch.right.y + v * patch.down.y - spot.y, 2);
      const auto ring = static_cast<std::size_t>(std::sqrt(r2) / ring_mm);
      if (ring >= SpotRings::kCount || weight[at] == 0) {
        continue;
      }
      if (rates.variance[at] < 0) {
        return {};
      }
      rings.sum[ring] += rates.rate[at] * weight[at];
      rings.pixels[ring] += 1;
      rings.square_mm2[ring] += static_cast<float>(r2);
    }
  }
  return rings;
}

}  // namespace nacre::reconstruct::internal

#include "calibrate/internal/spot_sums.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace nacre::calibrate::internal {

PixelGround MapPixels(const CameraGeometry& camera) {
  // Corners are shared by four pixels: map each once.
  const int stride = camera.width_px + 1;
  std::vector<PointMm> corners;
  corners.reserve(static_cast<std::size_t>(stride) *
                  static_cast<std::size_t>(camera.height_px + 1));
  for (int y = 0; y <= camera.height_px; ++y) {
    for (int x = 0; x <= camera.width_px; ++x) {
      corners.push_back(camera.SampleFromPixel({x - 0.5, y - 0.5}));
    }
  }
  PixelGround ground;
  ground.width = camera.width_px;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const auto k = static_cast<std::size_t>(std::int64_t{y} * stride + x);
      const PointMm& a = corners[k];
      const PointMm& b = corners[k + 1];
      const PointMm& c = corners[k + static_cast<std::size_t>(stride) + 1];
      const PointMm& d = corners[k + static_cast<std::size_t>(stride)];
      ground.centre.push_back(
          {0.25 * (a.x + b.x + c.x + d.x), 0.25 * (a.y + b.y + c.y + d.y)});
      // Half the cross product of the diagonals.
      ground.area_mm2.push_back(
          0.5 * std::abs((c.x - a.x) * (d.y - b.y) - (c.y - a.y) * (d.x - b.x)));
    }
  }
  return ground;
}

SpotSums::SpotSums(const PixelGround& ground,
                   const std::vector<float>& shares,
                   const std::vector<PointMm>& spots,
                   double reach_mm,
                   double core_mm)
    : width_(static_cast<std::size_t>(ground.width)), spot_count_(spots.size()) {
  for (std::size_t k = 0; k < ground.centre.size(); ++k) {
    const auto share = static_cast<double>(shares[k]);
    for (std::size_t s = 0; share > 0 && s < spots.size(); ++s) {
      const double dx = ground.centre[k].x - spots[s].x;
      const double dy = ground.centre[k].y - spots[s].y;
      const double r2 = dx * dx + dy * dy;
      if (r2 <= reach_mm * reach_mm) {
        members_.push_back({k, s, share * ground.area_mm2[k], r2 <= core_mm * core_mm});
      }
    }
  }
}

std::vector<double> SpotSums::Of(const std::vector<float>& rates) const {
  std::vector<double> sums(spot_count_, 0.0);
  for (const Member& member : members_) {
    sums[member.spot] += static_cast<double>(rates[member.pixel]) * member.area_mm2;
  }
  return sums;
}

std::vector<double> SpotSums::Variances(const std::vector<double>& pixels,
                                        double row) const {
  std::vector<double> variances(spot_count_, 0.0);
  std::vector<double> row_areas(spot_count_, 0.0);
  std::vector<std::size_t> rows(spot_count_, 0);
  const auto end_row = [&](std::size_t spot) {
    variances[spot] += row * row_areas[spot] * row_areas[spot];
    row_areas[spot] = 0;
  };
  for (const Member& member : members_) {  // row by row
    variances[member.spot] += pixels[member.pixel] * member.area_mm2 * member.area_mm2;
    if (rows[member.spot] != member.pixel / width_) {
      end_row(member.spot);
      rows[member.spot] = member.pixel / width_;
    }
    row_areas[member.spot] += member.area_mm2;
  }
  for (std::size_t spot = 0; spot < spot_count_; ++spot) {
    end_row(spot);
  }
  return variances;
}

double SpotSums::PixelsASpot(const std::vector<float>& rates) const {
  std::vector<double> sums(spot_count_, 0.0);
  std::vector<double> squares(spot_count_, 0.0);
  for (const Member& member : members_) {
    const double weight = static_cast<double>(rates[member.pixel]) * member.area_mm2;
    sums[member.spot] += weight;
    squares[member.spot] += weight * weight;
  }
  double mean = 0;
  for (std::size_t s = 0; s < spot_count_; ++s) {
    mean += sums[s] * sums[s] / squares[s] / static_cast<double>(spot_count_);
  }
  return mean;
}

double SpotSums::RadiusMm(const PixelGround& ground,
                          const std::vector<PointMm>& spots,
                          const std::vector<float>& rates,
                          double share) const {
  std::vector<std::pair<double, double>> light;  // by radius²
  double total = 0;
  double area_mm2 = 0;
  for (const Member& member : members_) {
    const PointMm& p = ground.centre[member.pixel];
    const PointMm& s = spots[member.spot];
    const double w = static_cast<double>(rates[member.pixel]) * member.area_mm2;
    light.emplace_back((p.x - s.x) * (p.x - s.x) + (p.y - s.y) * (p.y - s.y), w);
    total += w;
    area_mm2 += ground.area_mm2[member.pixel] / static_cast<double>(members_.size());
  }
  std::sort(light.begin(), light.end());
  double sum = 0;
  for (const auto& [radius2, w] : light) {
    sum += w;
    if (sum >= share * total) {
      // Of a round Gaussian r² = −2 σ² ln(1 − share); a pixel's σ² is area / 12.
      const double pixel2 = -2 * std::log1p(-share) * area_mm2 / 12;
      return std::sqrt(std::max(0.0, radius2 - pixel2));
    }
  }
  return 0;
}

namespace {

// Light and its moments about the plane's origin.
struct Moments {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  std::size_t brightest = 0;  // pixel
  float peak = 0;
};

// Second moments of a pixel's parallelogram with edges a and b: (a aᵀ + b bᵀ) / 12.
SpotProfile PixelProfile(const PixelGround& ground, std::size_t pixel) {
  const auto width = static_cast<std::size_t>(ground.width);
  const std::size_t right = pixel % width + 1 < width ? pixel + 1 : pixel - 1;
  const std::size_t down =
      pixel + width < ground.centre.size() ? pixel + width : pixel - width;
  const PointMm& at = ground.centre[pixel];
  const PointMm a{ground.centre[right].x - at.x, ground.centre[right].y - at.y};
  const PointMm b{ground.centre[down].x - at.x, ground.centre[down].y - at.y};
  return {.xx_mm2 = (a.x * a.x + b.x * b.x) / 12,
          .xy_mm2 = (a.x * a.y + b.x * b.y) / 12,
          .yy_mm2 = (a.y * a.y + b.y * b.y) / 12};
}

}  // namespace

SpotProfile SpotSums::Profile(const PixelGround& ground,
                              const std::vector<float>& rates) const {
  std::vector<Moments> moments(spot_count_);
  for (const Member& member : members_) {
    if (!member.is_core) {
      continue;
    }
    Moments& m = moments[member.spot];
    const double w = static_cast<double>(rates[member.pixel]) * member.area_mm2;
    const PointMm p = ground.centre[member.pixel];
    m.w += w;
    m.x += w * p.x;
    m.y += w * p.y;
    m.xx += w * p.x * p.x;
    m.xy += w * p.x * p.y;
    m.yy += w * p.y * p.y;
    if (rates[member.pixel] > m.peak) {
      m.peak = rates[member.pixel];
      m.brightest = member.pixel;
    }
  }
  SpotProfile profile;
  double square = 0;
  const auto n = static_cast<double>(spot_count_);
  for (const Moments& m : moments) {
    const double x = m.x / m.w;
    const double y = m.y / m.w;
    const SpotProfile pixel = PixelProfile(ground, m.brightest);
    const double xx = m.xx / m.w - x * x - pixel.xx_mm2;
    profile.xx_mm2 += xx / n;
    profile.xy_mm2 += (m.xy / m.w - x * y - pixel.xy_mm2) / n;
    profile.yy_mm2 += (m.yy / m.w - y * y - pixel.yy_mm2) / n;
    square += xx * xx / n;
  }
  profile.sigma_mm2 =
      std::sqrt(std::max(0.0, square - profile.xx_mm2 * profile.xx_mm2) / n);
  return profile;
}

}  // namespace nacre::calibrate::internal

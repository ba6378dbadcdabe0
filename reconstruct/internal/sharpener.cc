#include "reconstruct/internal/sharpener.h"

#include <algorithm>
#include <cstdlib>

namespace nacre::reconstruct::internal {

Sharpener::Sharpener(const calibrate::SpotProfile& spot,
                     const calibrate::CameraGeometry& camera) {
  const calibrate::PixelPoint centre{0.5 * (camera.width_px - 1),
                                     0.5 * (camera.height_px - 1)};
  const auto step = [&](double dx, double dy) {
    const PointMm a =
        camera.SampleFromPixel({centre.x - 0.5 * dx, centre.y - 0.5 * dy});
    const PointMm b =
        camera.SampleFromPixel({centre.x + 0.5 * dx, centre.y + 0.5 * dy});
    return PointMm{b.x - a.x, b.y - a.y};
  };
  // C_px = J⁻¹ C J⁻ᵀ, J the steps right and down in mm.
  const PointMm right = step(1, 0);
  const PointMm down = step(0, 1);
  const double determinant = right.x * down.y - right.y * down.x;
  const PointMm u{down.y / determinant, -down.x / determinant};
  const PointMm v{-right.y / determinant, right.x / determinant};
  const auto moment = [&](PointMm a, PointMm b) {
    return a.x * b.x * spot.xx_mm2 + (a.x * b.y + a.y * b.x) * spot.xy_mm2 +
           a.y * b.y * spot.yy_mm2;
  };
  along_x_ = TapsFor(moment(u, u));
  along_y_ = TapsFor(moment(v, v));
  cross_px2_ = moment(u, v);
}

Sharpener::Taps Sharpener::TapsFor(double variance_px2) {
  const double s = 0.5 * variance_px2;
  const std::array<double, 3> q = {
      s, s / 12 + s * s / 2, s / 90 + s * s / 12 + s * s * s / 6};
  // q = 2 − (left + right), q² and q³ by the binomial's alternating rows.
  return {1 + 2 * q[0] + 6 * q[1] + 20 * q[2],
          -q[0] - 4 * q[1] - 15 * q[2],
          q[1] + 6 * q[2],
          -q[2]};
}

void Sharpener::Filter(const Taps& taps, std::size_t step, int count, double* line) {
  std::vector<double> old;
  old.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    old.push_back(line[static_cast<std::size_t>(k) * step]);
  }
  for (int k = 0; k < count; ++k) {
    double sum = 0;
    for (int to = std::max(0, k - kReach); to <= std::min(count - 1, k + kReach);
         ++to) {
      sum += taps[static_cast<std::size_t>(std::abs(to - k))] *
             old[static_cast<std::size_t>(to)];
    }
    line[static_cast<std::size_t>(k) * step] = sum;
  }
}

void Sharpener::Apply(std::vector<double>& weights, int width, int height) const {
  const auto stride = static_cast<std::size_t>(width);
  if (cross_px2_ != 0) {
    // −σ_xy ∂x ∂y by the four diagonal neighbours.
    const std::vector<double> old = weights;
    for (int y = 1; y + 1 < height; ++y) {
      for (int x = 1; x + 1 < width; ++x) {
        const std::size_t at =
            static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x);
        const double part = 0.25 * cross_px2_ * old[at];
        weights[at - stride - 1] -= part;
        weights[at + stride + 1] -= part;
        weights[at - stride + 1] += part;
        weights[at + stride - 1] += part;
      }
    }
  }
  for (int y = 0; y < height; ++y) {
    Filter(along_x_, 1, width, &weights[static_cast<std::size_t>(y) * stride]);
  }
  for (int x = 0; x < width; ++x) {
    Filter(along_y_, stride, height, &weights[static_cast<std::size_t>(x)]);
  }
}

}  // namespace nacre::reconstruct::internal

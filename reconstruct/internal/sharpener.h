#pragma once

#include "calibrate/calibration.h"

#include <array>
#include <vector>

namespace nacre::reconstruct::internal {

/// Undoes the blur of the laser's spot in the weights that pixels have: a symmetric
/// filter of the picture is the same filter of the weights. Along each axis
///   e^(s k²),  s = σ²/2,  k² = q + q²/12 + q³/90 + …,  q = 4 sin²(k/2)
/// to third order in q = −D₂, the second difference of pixels, which is seven pixels
/// wide; what the axes have in common, e^(σ_xy k_x k_y), to first order. The sum of the
/// weights stays.
class Sharpener {
 public:
  /// How far weights spread, pixels.
  static constexpr int kReach = 3;

  /// A spot's moments on the plane; pixels are taken to be alike all over the picture.
  Sharpener(const calibrate::SpotProfile& spot,
            const calibrate::CameraGeometry& camera);

  /// Of a dense box of pixels, row by row, with kReach empty ones around.
  void Apply(std::vector<double>& weights, int width, int height) const;

 private:
  using Taps = std::array<double, kReach + 1>;  // from the middle on
  static Taps TapsFor(double variance_px2);
  static void Filter(const Taps& taps, std::size_t step, int count, double* line);

  Taps along_x_;
  Taps along_y_;
  double cross_px2_;
};

}  // namespace nacre::reconstruct::internal

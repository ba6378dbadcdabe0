#pragma once

#include <array>
#include <cstdint>

namespace nacre::rigs {

/// Gradient noise in space [Perlin02]: smooth, zero at whole coordinates, about as
/// often positive as negative, values within ±1. A pure function of the seed and the
/// point, whose coordinates must be within ±2³¹; it repeats every 256 units.
class GradientNoise {
 public:
  explicit GradientNoise(std::uint64_t seed);

  double At(double x, double y, double z) const;

  /// Σ 2^−k At(2^k p), k = 0 … octaves − 1: detail down to 2^−octaves.
  double Turbulent(double x, double y, double z, int octaves) const;

 private:
  std::array<std::uint8_t, 514> permutation_{};  // twice, and a little more
};

}  // namespace nacre::rigs

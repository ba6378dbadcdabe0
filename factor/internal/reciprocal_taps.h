#pragma once

#include <vector>

namespace nacre::factor::internal {

/// A share of what a tap takes from the maps: `weight` of the grid point (dx, dy) away
/// from the first point of a pair.
struct TapPoint {
  int tap = 0;  ///< 1: the middle of the way, 2: its quarters, 3: its odd eighths
  int dx = 0;
  int dy = 0;
  float weight = 0;
};

/// Logarithms of R_d over A are cut there, while fitting and in a material: three
/// peaks.
inline constexpr double kMostLog = 1.0986;

/// And logarithms of what sides make of it, either way.
inline constexpr double kMostSide = 1;

/// Most taps of a reciprocal material: the ends, the middle, the quarters, the eighths.
inline constexpr int kMostTaps = 4;

/// The points that the taps beyond the ends (which is tap 0) of an offset d = (du, dv)
/// take, by bilinear interpolation, weights of a tap adding up to 2. They are multiples
/// of 1/128 and come in the order of the picture, so that sums over them are the same
/// numbers from either end.
std::vector<TapPoint> TapPoints(int du, int dv, int taps);

/// Numbers of a reciprocal material's kernels: a constant, then a kernel a tap and
/// term, then one for each two terms (0, 0), (0, 1), …, (1, 1), …
constexpr int TapKernel(int terms, int tap, int term) {
  return 1 + tap * terms + term;
}
constexpr int PairKernel(int terms, int taps, int j, int k) {
  return 1 + taps * terms + j * terms - j * (j - 1) / 2 + k - j;
}
constexpr int ReciprocalKernelCount(int terms, int taps) {
  return 1 + taps * terms + terms * (terms + 1) / 2;
}

}  // namespace nacre::factor::internal

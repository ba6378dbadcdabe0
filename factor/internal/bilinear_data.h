#pragma once

#include "factor/internal/method.h"
#include "factor/internal/shared_maps.h"

#include <algorithm>
#include <vector>

namespace nacre::factor::internal {

/// Points x of planes, from x0 and y0 to before x1 and y1.
struct PairArea {
  int x0 = 0;
  int x1 = 0;
  int y0 = 0;
  int y1 = 0;
};

/// A dataset as pairs of points. What light that enters at one point and leaves at
/// another does is measured twice, once in the window of each; here both are one
/// number, their mean, for half of all offsets d: those of cells up to the middle one.
/// Planes over the first point of the pair, one a channel and cell, reach beyond the
/// grid by the window's radius, so that pairs that leave the grid are there too.
struct BilinearData {
  int width = 0;
  int height = 0;
  int margin = 0;
  int core = 0;
  std::size_t channels = 0;
  std::size_t cells = 0;            ///< (core² + 1) / 2
  double scale = 1;                 ///< mm⁻²: `values` times it are R_d
  std::vector<float> values;        ///< [channel][cell][y][x]; 0 where count is 0
  std::vector<std::uint8_t> count;  ///< measurements in the mean: 0, 1 or 2
  std::vector<double> weight;       ///< [channel][cell], of a measurement
  bool same_count = true;           ///< the same for all channels

  std::size_t Plane() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  std::size_t Offset(std::size_t channel, std::size_t cell) const {
    return (channel * cells + cell) * Plane();
  }
  int OffsetX(std::size_t cell) const {
    return static_cast<int>(cell) % core - (core - 1) / 2;
  }
  int OffsetY(std::size_t cell) const {
    return static_cast<int>(cell) / core - (core - 1) / 2;
  }
  /// Where x + d lies within the planes too.
  PairArea OverlapOf(int du, int dv) const {
    return {std::max(0, -du),
            width - std::max(0, du),
            std::max(0, -dv),
            height - std::max(0, dv)};
  }
};

/// Bytes that ReadPairs will take.
double PairBytes(const reconstruct::RdHeader& header);

/// Reads a dataset as pairs, in one pass, with weights 1 / (R̄(d) + ε)^q, R̄ being the
/// mean over the pairs of an offset and ε 1e-5 of the largest: q = 0 counts the error
/// in R_d, q = 1 that relative to its root, which is what photons' noise goes by.
///
/// `start` returns maps to begin with: coordinates of the slices in the leading
/// singular vectors of the sample's, all channels in a row, up to `terms` of them.
BilinearData ReadPairs(Job& job, int terms, double tail_weight, SharedMaps& start);

}  // namespace nacre::factor::internal

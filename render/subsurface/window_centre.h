#pragma once

#include "render/subsurface/color_lanes.h"

#include <array>

namespace nacre::render {

/// The middle of a window R_d(x_i, ·), 3 × 3 cells, as a finer lattice of nodes half a
/// pitch apart, to be interpolated bilinearly.
///
/// A dataset holds means over cells. Bilinear interpolation between them keeps the sum
/// over all cells but wears down the peak: the cell at d = 0, which may hold most of
/// the light, would keep only half of it. Here it keeps its mean. Nodes between cells
/// get the harmonic mean of their neighbours, which is below twice the least of them,
/// so that the nodes at the centres, solved for the means, aren't negative; nodes on
/// the rim agree with bilinear interpolation between the cells, which goes on from
/// there. The sum over the whole window is kept exactly.
class WindowCentre {
 public:
  /// Cells from −2 to 2 in both directions, row by row from the top.
  using Cells = std::array<ColorLanes, 25>;

  WindowCentre() = default;
  explicit WindowCentre(const Cells& cells);

  static bool Covers(float column, float row) {
    return column >= -kHalfWidth && column < kHalfWidth && row >= -kHalfWidth &&
           row < kHalfWidth;
  }

  static constexpr int kNodes = 7;
  using Nodes = std::array<ColorLanes, kNodes * kNodes>;
  const Nodes& nodes() const { return nodes_; }

  /// R_d at an offset in pitches, columns to the right and rows downwards, that is
  /// covered; from nodes() wherever they are kept.
  static ColorLanes At(const ColorLanes* nodes, float column, float row) {
    const float x = (column + kHalfWidth) * 2;
    const float y = (row + kHalfWidth) * 2;
    const int i = static_cast<int>(x);
    const int j = static_cast<int>(y);
    const ColorLanes* node = nodes + (j * kNodes + i);
    const float across = x - static_cast<float>(i);
    return Mix(Mix(node[0], node[1], across),
               Mix(node[kNodes], node[kNodes + 1], across),
               y - static_cast<float>(j));
  }

 private:
  static constexpr float kHalfWidth = 1.5F;
  Nodes nodes_{};
};

}  // namespace nacre::render

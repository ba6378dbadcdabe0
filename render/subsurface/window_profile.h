#pragma once

#include "render/subsurface/color_lanes.h"
#include "render/subsurface/dipole_table.h"

#include <array>
#include <span>
#include <vector>

namespace nacre::render {

/// How light falls off within and around the cells of one window R'_d(x_i, ·), which
/// holds means over cells only. Lengths are in pitches.
///
/// Its radial function P(r) starts as that of the half-space [Jensen01] which sends
/// back as much as the window does and as large a share of it from the cell around
/// r = 0; then it is corrected so that its sums over rings of cells, a pitch wide, are
/// the window's. So inside a cell it has the shape that a medium would give it, and
/// from a pitch on that which was measured. A channel of which nothing is known (a
/// window that is dark) has P = 1.
class WindowProfile {
 public:
  WindowProfile() = default;
  /// `cells`: core × core means. `internal_reflectance`: diffuse, of the surface from
  /// inside.
  WindowProfile(std::span<const ColorLanes> cells,
                int core,
                double internal_reflectance);

  ColorLanes At(float r2) const {
    const auto [index, fraction] = axis_.Find(r2 + kSoft2);
    const ColorLanes* entry = &table_[index];
    return Mix(entry[0], entry[1], fraction);
  }
  void Prefetch(float r2) const {
    __builtin_prefetch(&table_[axis_.Find(r2 + kSoft2).index]);
  }

  /// Over the cell `column` to the right of x_i's and `row` below: the mean of P, and
  /// the mean place of its light from the cell's middle.
  struct Moments {
    ColorLanes mean;
    ColorLanes column;
    ColorLanes row;
  };
  Moments OfCell(int column, int row) const;

 private:
  /// No peak is narrower than this, because patches half a pitch wide couldn't draw it.
  static constexpr double kSharpest = 0.2;
  static constexpr float kSoft2 = static_cast<float>(kSharpest * kSharpest);

  void Start(std::size_t channel, double total, double share, double reflectance);
  void CorrectRings(std::span<const ColorLanes> cells, int core);

  OctaveAxis<2> axis_;  ///< of r² + kSoft2
  std::vector<ColorLanes> table_;
};

}  // namespace nacre::render

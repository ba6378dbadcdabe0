#pragma once

#include "acquire/rig.h"
#include "rigs/pattern.h"
#include "rigs/transport/transport.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace nacre::rigs::diffusion {

/// A symmetry of the square: first the axes are exchanged, then mirrored.
struct WindowSymmetry {
  bool transpose = false;  ///< x ↔ y
  bool mirror_x = false;   ///< x → −x
  bool mirror_y = false;
  friend bool operator==(const WindowSymmetry&, const WindowSymmetry&) = default;
};

/// The grid's points up to the pattern's symmetries. Point k (row by row from the top)
/// has the window of points[of[k]], put through symmetry[k].
struct DistinctPoints {
  std::vector<PointMm> points;
  std::vector<std::uint32_t> of;
  std::vector<WindowSymmetry> symmetry;
};

/// Positions are compared to 1e-6 of a cell. Chessboard: shifts by two cells along an
/// axis or one along both, mirrors about a cell's middle, transposition; stripes:
/// shifts along y, by two stripes along x, mirrors; homogeneous: one point is all;
/// mixtures: every point is distinct.
DistinctPoints FindDistinctPoints(const Pattern& pattern,
                                  const acquire::GridDescription& grid);

/// `window` (channels · core · core) put through the symmetry.
Window Transformed(const Window& window, int core, const WindowSymmetry& symmetry);

}  // namespace nacre::rigs::diffusion

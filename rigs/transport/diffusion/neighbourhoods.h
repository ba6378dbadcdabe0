#pragma once

#include "acquire/rig.h"
#include "rigs/pattern.h"

#include <cstddef>
#include <span>
#include <vector>

namespace nacre::rigs::diffusion {

/// Beams that share a mesh: `columns` × `rows` points of the grid from `first`, its
/// lower left one, and which of them are wanted.
struct Neighbourhood {
  PointMm first;
  int columns = 1;
  int rows = 1;
  std::vector<PointMm> points;
  std::vector<std::size_t> indices;  ///< of the points, in the caller's list
};

/// Points of the grid in tiles of 4 × 4, the same tiles whatever points are asked for;
/// others alone. At most `most` points each, in the order of their first points.
std::vector<Neighbourhood> GroupPoints(std::span<const PointMm> points,
                                       const acquire::GridDescription& grid,
                                       std::size_t most);

Neighbourhood AloneAt(PointMm point);

}  // namespace nacre::rigs::diffusion

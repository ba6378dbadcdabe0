#pragma once

#include "rigs/pattern.h"
#include "rigs/transport/cell_quadrature.h"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace nacre::rigs {

/// Values of all channels, channel after channel, at points given as offsets from x_i.
using WindowFunction = std::function<void(const PointColumns& offsets, float* values)>;

/// Means over all cells of a window by fixed nodes; channel after channel, as a Window.
void IntegrateCells(const CellQuadrature& quadrature,
                    std::size_t channels,
                    const WindowFunction& function,
                    std::span<float> means);

struct RefineOptions {
  int core = 1;
  double pitch_mm = 1;
  double tolerance = 5e-4;  ///< relative, of a cell's mean
  int most_levels = 7;
};

/// Replaces the means of those cells by adaptive ones: boxes are quartered until the
/// mean of a box and that of its quarters agree. For functions with kinks and ridges.
void RefineCells(const RefineOptions& options,
                 std::span<const std::size_t> cells,
                 std::size_t channels,
                 const WindowFunction& function,
                 std::span<float> means);

}  // namespace nacre::rigs

#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace nacre::rigs {

/// Nodes and weights for the means of a function of x_o − x_i over the core × core
/// cells of a window, cell after cell, row by row from the top (+y). The function peaks
/// at the origin, in the middle of the central cell, over a width that may be far below
/// the pitch: there the cell is cut into four triangles that meet at the peak, and the
/// nodes crowd towards it [Duffy82]; elsewhere Gauss–Legendre grids, as fine as needed.
struct CellQuadrature {
  std::vector<float> dx_mm;
  std::vector<float> dy_mm;
  std::vector<float> weight;            ///< 1 in sum, for each cell
  std::vector<std::size_t> cell_begin;  ///< core² + 1 indices into the columns

  std::size_t CellCount() const { return cell_begin.size() - 1; }
};

struct CellQuadratureOptions {
  int core = 1;
  double pitch_mm = 1;
  double tolerance = 2e-4;  ///< relative, of each cell's mean of each profile
  int least_order = 3;      ///< nodes along a side of the smoothest cells
};

/// Chooses each cell's order so that the means of all these radial profiles R(r) are
/// within the tolerance of the next finer grid's.
CellQuadrature MakeCellQuadrature(
    const CellQuadratureOptions& options,
    std::span<const std::function<double(double r_mm)>> profiles);

}  // namespace nacre::rigs

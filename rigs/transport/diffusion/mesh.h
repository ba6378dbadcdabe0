#pragma once

#include <cstddef>
#include <vector>

namespace nacre::rigs::diffusion {

/// Cells along one axis, between ascending edges.
struct Axis {
  std::vector<double> edges_mm;

  int Count() const { return static_cast<int>(edges_mm.size()) - 1; }
  double Low(int i) const { return edges_mm[static_cast<std::size_t>(i)]; }
  double High(int i) const { return edges_mm[static_cast<std::size_t>(i) + 1]; }
  double Width(int i) const { return High(i) - Low(i); }
  double Centre(int i) const { return 0.5 * (Low(i) + High(i)); }
};

/// Columns of cells under the sample plane; z is the depth below the surface.
struct Mesh {
  Axis x;
  Axis y;
  Axis z;
};

Axis UniformAxis(double low_mm, double high_mm, int count);

/// `count` cells of width `step_mm` from `low_mm` on; on both sides `guard` more of
/// them, then cells that grow by `growth` a cell until they have covered `margin_mm`.
struct CoreAndMargins {
  double low_mm = 0;
  double step_mm = 1;
  int count = 1;
  double margin_mm = 0;
  int guard = 0;
  double growth = 1.3;
};
/// Margins have equally many cells; `*margin_cells` is how many.
Axis GradedAxis(const CoreAndMargins& layout, int* margin_cells);

/// From 0 to `depth_mm`: the first cell about `first_mm` thick, each next one `growth`
/// times as thick, none thicker than `thickest_mm`.
struct DepthLayout {
  double depth_mm = 1;
  double first_mm = 0.1;
  double growth = 1.2;
  double thickest_mm = 1;
};
Axis DepthAxis(const DepthLayout& layout);

}  // namespace nacre::rigs::diffusion

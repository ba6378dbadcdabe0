#include "rigs/transport/diffusion/mesh.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs::diffusion {

Axis UniformAxis(double low_mm, double high_mm, int count) {
  Expect(count >= 1 && high_mm > low_mm, "an axis with cells");
  Axis axis;
  for (int i = 0; i <= count; ++i) {
    axis.edges_mm.push_back(std::lerp(low_mm, high_mm, static_cast<double>(i) / count));
  }
  return axis;
}

Axis GradedAxis(const CoreAndMargins& layout, int* margin_cells) {
  Expect(layout.count >= 1 && layout.step_mm > 0 && layout.growth >= 1,
         "an axis with cells");
  std::vector<double> margin;  // widths, outwards
  double covered = 0;
  double width = layout.step_mm;
  while (covered < layout.margin_mm) {
    if (margin.size() >= static_cast<std::size_t>(layout.guard)) {
      width *= layout.growth;
    }
    margin.push_back(width);
    covered += width;
  }
  Axis axis;
  double edge = layout.low_mm - covered;
  for (std::size_t k = margin.size(); k-- > 0;) {
    axis.edges_mm.push_back(edge);
    edge += margin[k];
  }
  for (int i = 0; i <= layout.count; ++i) {
    axis.edges_mm.push_back(layout.low_mm + i * layout.step_mm);
  }
  for (const double w : margin) {
    axis.edges_mm.push_back(axis.edges_mm.back() + w);
  }
  *margin_cells = static_cast<int>(margin.size());
  return axis;
}

Axis DepthAxis(const DepthLayout& layout) {
  Expect(layout.depth_mm > 0 && layout.first_mm > 0 && layout.growth >= 1,
         "a depth axis with cells");
  std::vector<double> widths;
  double covered = 0;
  double width = std::min(layout.first_mm, layout.depth_mm);
  while (covered < layout.depth_mm * (1 - 1e-9)) {
    widths.push_back(width);
    covered += width;
    width = std::min(width * layout.growth, layout.thickest_mm);
  }
  // The last cell overshoots; all shrink alike so that the bottom is met exactly.
  Axis axis{{0.0}};
  for (const double w : widths) {
    axis.edges_mm.push_back(axis.edges_mm.back() + w * layout.depth_mm / covered);
  }
  axis.edges_mm.back() = layout.depth_mm;
  return axis;
}

}  // namespace nacre::rigs::diffusion

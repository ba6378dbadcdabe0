#include "rigs/sample_pose.h"

#include <cmath>

namespace nacre::rigs {

Placement SamplePose::SampleFromSurface() const {
  const double a = slope_x;
  const double b = slope_y;
  const double along = 1 / std::sqrt(1 + a * a);
  const double across = 1 / std::sqrt((1 + a * a) * (1 + a * a + b * b));
  const double up = 1 / std::sqrt(1 + a * a + b * b);
  Placement placement;  // columns: along x, across it, the normal
  placement.rotation = {{{along, -a * b * across, -a * up},
                         {0, (1 + a * a) * across, -b * up},
                         {a * along, b * across, up}}};
  placement.translation_mm = {0, 0, height_mm};
  return placement;
}

PointMm SamplePose::SurfaceFromSample(PointMm point) const {
  const Placement placement = SampleFromSurface();
  const Vector3 offset = {point.x, point.y, HeightAt(point) - height_mm};
  PointMm surface;
  for (std::size_t k = 0; k < 3; ++k) {
    surface.x += placement.rotation[k][0] * offset[k];
    surface.y += placement.rotation[k][1] * offset[k];
  }
  return surface;
}

}  // namespace nacre::rigs

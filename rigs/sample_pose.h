#pragma once

#include "rigs/pinhole.h"

namespace nacre::rigs {

/// How a sample lies that should lie in the plane z = 0: its surface is z = height +
/// slope_x x + slope_y y. Coordinates on it: the origin is above the sample plane's,
/// the x axis above that plane's.
struct SamplePose {
  double height_mm = 0;
  double slope_x = 0;
  double slope_y = 0;

  bool IsIdeal() const { return height_mm == 0 && slope_x == 0 && slope_y == 0; }
  double HeightAt(PointMm point) const {
    return height_mm + slope_x * point.x + slope_y * point.y;
  }
  Placement SampleFromSurface() const;
  /// A point on the surface, given above which point of z = 0 it is.
  PointMm SurfaceFromSample(PointMm point) const;
};

}  // namespace nacre::rigs

#pragma once

#include "rigs/pinhole.h"

#include <cstddef>
#include <vector>

namespace nacre::rigs {

/// What each pixel of a camera looks at, in the coordinates of some plane: a smooth map
/// stored at the pixels' centres, row by row from the top.
struct PlaneMap {
  int width = 0;
  int height = 0;
  std::vector<float> x;
  std::vector<float> y;

  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }

  /// At a place within a pixel, du and dv in [−½, ½] from its centre: linear, with the
  /// slopes to the neighbours.
  PointMm At(int column, int row, double du, double dv) const;

  /// The size of a pixel in the middle of the picture, in the units of the plane.
  double PixelSize() const;
};

/// Rays in normalised image coordinates, lens distortion undone.
PlaneMap MapRays(const PinholeCamera& camera, int thread_count = 0);

/// The sample plane, mm.
PlaneMap MapSample(const PinholeCamera& camera, int thread_count = 0);

/// Where those rays meet the plane z = 0 of a frame that stands somewhere in the
/// camera's.
PlaneMap MapPlane(const PlaneMap& rays, const Placement& camera_from_plane);

}  // namespace nacre::rigs

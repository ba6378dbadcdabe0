#pragma once

#include "rigs/phantom_voxels.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace nacre::rigs {

/// An ellipsoid of another medium.
struct Inclusion {
  std::size_t medium = 0;
  std::array<double, 3> centre_mm{};  ///< x, y and depth
  std::array<double, 3> radii_mm{};   ///< along the two axes in the plane and depth
  double turn_rad = 0;                ///< of the first axis, counter-clockwise from +x

  bool Contains(double x_mm, double y_mm, double depth_mm) const;
};

/// Spheres strewn evenly over a box, their radii even between two bounds. They may
/// overlap.
struct Strewn {
  std::size_t medium = 0;
  int count = 0;
  std::uint64_t seed = 1;
  double smallest_mm = 0;  ///< radius
  double largest_mm = 0;
  std::array<double, 3> low_mm{};  ///< corner of the box for centres: x, y, depth
  std::array<double, 3> high_mm{};
};

std::vector<Inclusion> Strew(const Strewn& strewn);

/// The first medium with inclusions in it; a later one hides an earlier one. A voxel is
/// of the medium at its centre.
Voxels PlaceInclusions(const VoxelLayout& layout,
                       std::size_t medium_count,
                       const std::vector<Inclusion>& inclusions);

}  // namespace nacre::rigs

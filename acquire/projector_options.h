#pragma once

#include <array>
#include <vector>

namespace nacre::acquire {

/// How a video projector on a display of its own is to be found and driven.
struct ProjectorOptions {
  int display = 1;  ///< 0 is the first
  double max_angle_rad =
      0;  ///< from the middle of the picture to its left or right end
  std::array<double, 2> field_x_rad{};  ///< nothing is lit outside
  std::array<double, 2> field_y_rad{};
  int spot_px = 9;            ///< diameter of a spot; odd
  std::vector<double> power;  ///< a channel; share of full drive
  double refresh_hz = 60;     ///< exposures are whole frames of it
  double settle_ms = 100;     ///< from a picture's being handed over to its being seen
};

}  // namespace nacre::acquire

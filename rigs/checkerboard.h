#pragma once

#include "rigs/plane_map.h"

#include <vector>

namespace nacre::rigs {

/// A printed checkerboard: (columns + 1) × (rows + 1) squares around columns × rows
/// inner corners, black in the upper left, on white card with a margin of one square,
/// on a dark table.
struct CheckerboardModel {
  int columns = 0;
  int rows = 0;
  double square_mm = 0;
  double white_reflectance = 0.85;
  double black_reflectance = 0.06;
  double table_reflectance = 0.03;

  /// Reflectance at a point of the board: mm from its centre, +x right, +y up.
  double ReflectanceAt(PointMm point) const;
};

/// sample_from_board in a pose. Pose 0 lies in the sample plane, centred on the origin;
/// the others are tilted by 20 to 30 degrees in directions all round, and turned,
/// shifted and lifted a little.
Placement BoardPlacement(int pose);

/// The mean reflectance that each pixel sees, row by row from the top.
std::vector<float> ViewCheckerboard(const CheckerboardModel& board,
                                    const PlaneMap& rays,
                                    const Placement& camera_from_board,
                                    int thread_count = 0);

}  // namespace nacre::rigs

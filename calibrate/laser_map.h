#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"

#include <vector>

namespace nacre::calibrate {

struct LaserMapResult {
  acquire::ScanMap map;
  double rms_mm = 0;  ///< distance of the spots from where the map puts them
  double max_mm = 0;
};

/// Where the beam goes, from the pictures of the laser lattice on the reference target.
/// The spots are told apart by their arrangement: the scanner must be mounted so that
/// +x_rad moves the beam towards +x within some 20 degrees, and likewise for y. Throws
/// BadData naming the picture if it doesn't show n × n spots.
LaserMapResult EstimateLaserMap(const acquire::SessionReader& session,
                                const CameraGeometry& camera,
                                const DarkLevel& dark);

/// The centroids of exactly `count` bright spots on a dark ground, in no order; empty
/// if there are not that many. `signal` is counts above dark, row by row from the top.
std::vector<PixelPoint> FindSpots(const std::vector<float>& signal,
                                  int width,
                                  int height,
                                  int count);

/// Cubic polynomials both ways through pairs of angle and position (least squares).
LaserMapResult FitScanMap(const std::vector<acquire::ScanAngle>& angles,
                          const std::vector<PointMm>& points);

}  // namespace nacre::calibrate

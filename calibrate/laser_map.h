#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/rate_picture.h"

#include <vector>

namespace nacre::calibrate {

/// Where a spot was seen, and how far from where the map puts it.
struct SpotResidual {
  PointMm at;
  PointMm off;
};

struct LaserMapResult {
  acquire::ScanMap map;
  double rms_mm = 0;  ///< distance of the spots from where the map puts them
  double max_mm = 0;
  double held_out_rms_mm = 0;  ///< of spots that had no part in the fit
  int missed = 0;              ///< spots of the lattice, not found or far off
  ScanHysteresis hysteresis;   ///< if every second picture was taken in reverse
  std::vector<SpotResidual> residuals;
};

/// Where the beam goes, from the pictures of the laser lattice on the reference target.
/// The spots are told apart by their arrangement: the scanner must be mounted so that
/// +x_rad moves the beam towards +x within some 20 degrees, and likewise for y. A tenth
/// of them may be missed. Throws BadData naming the picture if it shows fewer.
LaserMapResult EstimateLaserMap(const acquire::SessionReader& session,
                                const CameraGeometry& camera,
                                const RatePictures& pictures);

/// The centroids of `count` bright spots on a dark ground, in no order; empty if there
/// are not that many, `missing` fewer or more allowed. `signal` is counts above dark,
/// row by row from the top.
std::vector<PixelPoint> FindSpots(const std::vector<float>& signal,
                                  int width,
                                  int height,
                                  int count,
                                  int missing = 0);

/// Cubic polynomials both ways through pairs of angle and position (least squares).
LaserMapResult FitScanMap(const std::vector<acquire::ScanAngle>& angles,
                          const std::vector<PointMm>& points);

/// The rms distance of spots from maps that were fitted to four fifths of the others.
double HeldOutRmsMm(const std::vector<acquire::ScanAngle>& angles,
                    const std::vector<PointMm>& points);

}  // namespace nacre::calibrate

#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "core/progress.h"

#include <vector>

namespace nacre::calibrate {

/// Where a corner was seen, and how far from where the model puts it.
struct CornerResidual {
  PixelPoint at;
  PixelPoint off;
};

struct GeometryResult {
  CameraGeometry camera;
  double reprojection_rms_px = 0;
  double focal_sigma_px = 0;  ///< standard uncertainties, of the larger axis
  double centre_sigma_px = 0;
  double height_sigma_mm = 0;  ///< of the distance of pose 0
  std::vector<CornerResidual> residuals;
};

/// The camera from the session's checkerboard pictures [Zhang00], by way of OpenCV.
/// Pose 0 lies in the sample plane and defines it: its centre is the origin, its rows
/// run along +x. The board looks the same from the other side, so the camera must stand
/// upright: the sample's +x within 45 degrees of the picture's right.
///
/// Throws BadData naming the picture if a board can't be made out or the camera is
/// turned.
GeometryResult EstimateGeometry(const acquire::SessionReader& session,
                                const ProgressFunction& progress = {});

}  // namespace nacre::calibrate

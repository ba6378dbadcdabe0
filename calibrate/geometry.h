#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "core/progress.h"

namespace nacre::calibrate {

struct GeometryResult {
  CameraGeometry camera;
  double reprojection_rms_px = 0;
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

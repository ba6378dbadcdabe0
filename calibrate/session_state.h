#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "core/progress.h"

#include <vector>

namespace nacre::calibrate {

/// What only the pictures of the sample itself can say of a rig.
struct SessionState {
  /// Of every picture of the session: the laser's power relative to what it was when
  /// the reference was lit. 1 without a patch in view.
  std::vector<double> relative_flux;
  double drift_per_hour = 0;
  double drift_sigma_per_hour = 0;
  double patch_flux = 1;  ///< what the patch says of the flux scale, relative to it
  bool has_patch = false;

  /// Where the sample's surface lies, from where its spots are seen.
  SamplePlane plane;
  int spots_used = 0;  ///< for it; too few leave the plane as it is

  std::vector<Warning> warnings;
};

/// Looks at some of the session's pictures of the sample, the shortest exposures.
/// Power: a line through the patch's brightness over time. Plane: beam and line of
/// sight meet at the surface; a spot that is seen `s` from where it would be on the
/// sample plane lies s / |t_beam − t_sight| above it. Both are left as they are if
/// there are no pictures of the sample yet.
SessionState ExamineSession(const acquire::SessionReader& session,
                            const Calibration& calibration,
                            const ProgressFunction& progress = {},
                            int thread_count = 0);

/// Where on the sample's surface a beam arrives that is aimed at a point of the sample
/// plane, in the coordinates of CameraGeometry::OnPlane.
PointMm OnSurface(const Calibration& calibration,
                  const SamplePlane& plane,
                  PointMm point);

/// A guess of how long a rig that nobody touches stays as it is.
constexpr double kMaxAgeDays = 30;

/// Is the calibration of another session still true of this one? Its dark level, the
/// lattice on the reference (camera and laser) and the flux are compared; a warning for
/// each that differs by more than both uncertainties and what would matter. And
/// CompareAge.
std::vector<Warning> CompareWithSession(const acquire::SessionReader& session,
                                        const Calibration& calibration,
                                        double max_age_days = kMaxAgeDays);

/// `stale-by-age`, if the calibration's pictures were taken more than that before or
/// after the session's. Nothing where either's time isn't known.
std::vector<Warning> CompareAge(const acquire::SessionReader& session,
                                const Calibration& calibration,
                                double max_age_days);

}  // namespace nacre::calibrate

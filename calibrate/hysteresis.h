#pragma once

#include "acquire/illuminator.h"
#include "calibrate/calibration.h"

#include <vector>

namespace nacre::calibrate {

/// From which side (−1 or 1) each mirror comes to each of these, visited in their order
/// over and over; 0 if it never moves.
struct MirrorSides {
  std::vector<double> x;
  std::vector<double> y;
};
MirrorSides SidesOf(const std::vector<acquire::ScanAngle>& beams);

/// Where beams arrive on the sample plane that are visited in that order, hysteresis
/// allowed for: what Schedule::Beams says, for a picture of the sample.
std::vector<PointMm> BeamPositions(const Calibration& calibration,
                                   const std::vector<acquire::ScanAngle>& beams);

}  // namespace nacre::calibrate

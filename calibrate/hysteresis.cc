#include "calibrate/hysteresis.h"

namespace nacre::calibrate {
namespace {

std::vector<double> SidesAlong(const std::vector<acquire::ScanAngle>& beams,
                               double acquire::ScanAngle::*axis) {
  std::vector<double> sides(beams.size(), 0.0);
  double side = 0;
  for (int round = 0; round < 2; ++round) {  // the last precedes the first
    for (std::size_t k = 0; k < beams.size(); ++k) {
      const double before = beams[(k + beams.size() - 1) % beams.size()].*axis;
      const double move = beams[k].*axis - before;
      side = move > 0 ? 1 : move < 0 ? -1 : side;
      sides[k] = side;
    }
  }
  return sides;
}

}  // namespace

MirrorSides SidesOf(const std::vector<acquire::ScanAngle>& beams) {
  return {.x = SidesAlong(beams, &acquire::ScanAngle::x_rad),
          .y = SidesAlong(beams, &acquire::ScanAngle::y_rad)};
}

std::vector<PointMm> BeamPositions(const Calibration& calibration,
                                   const std::vector<acquire::ScanAngle>& beams) {
  const MirrorSides sides = SidesOf(beams);
  const ScanHysteresis& lag = calibration.corrections.hysteresis;
  std::vector<PointMm> positions;
  for (std::size_t k = 0; k < beams.size(); ++k) {
    positions.push_back(calibration.scan_map.SampleFromAngle(
        {beams[k].x_rad - lag.x_rad * sides.x[k],
         beams[k].y_rad - lag.y_rad * sides.y[k]}));
  }
  return positions;
}

}  // namespace nacre::calibrate

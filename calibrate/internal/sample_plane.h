#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"

#include <cstdint>
#include <vector>

namespace nacre::calibrate::internal {

/// A spot that was seen, as an equation for the plane: height(at) = height_mm.
struct Sighting {
  PointMm at;
  double height_mm = 0;  ///< that explains it
  double across_px = 0;  ///< what no height explains
  double px_per_mm = 0;  ///< its weight's root
};

/// Adds those of one picture of the sample.
void AddSightings(const acquire::SessionReader& session,
                  const Calibration& calibration,
                  const acquire::Frame& frame,
                  const std::vector<float>& rates,
                  std::int64_t number,
                  std::vector<Sighting>& sightings);

/// Least squares with outliers left out in rounds; `used` is how many were left.
SamplePlane FitPlane(std::vector<Sighting> sightings, int& used);

}  // namespace nacre::calibrate::internal

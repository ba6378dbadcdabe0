#pragma once

#include "acquire/camera.h"
#include "calibrate/calibration.h"

#include <optional>
#include <vector>

namespace nacre::calibrate::internal {

/// The light in a disc around a point, less what the ring around it has on the average.
struct Disc {
  double sum = 0;  ///< of rate · footprint
  PixelPoint centre;
  bool is_whole = false;  ///< in view, not saturated, and there is light
};
Disc SumDisc(const acquire::Frame& frame,
             const std::vector<float>& rates,
             const Calibration& calibration,
             PixelPoint about,
             double radius_px);

/// The share of a round Gaussian spot that SumDisc finds: the ring takes some as
/// ground.
double DiscShare(double radius_px, double spot_sigma_px);

/// The centre of gravity of a peak that goes on into the sample's glow; none if it
/// saturates or can't be found near there.
std::optional<PixelPoint> PeakCentre(const acquire::Frame& frame,
                                     const std::vector<float>& rates,
                                     const Calibration& calibration,
                                     PixelPoint about);

}  // namespace nacre::calibrate::internal

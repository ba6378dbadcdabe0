#pragma once

#include "calibrate/corrections.h"

#include <cstddef>
#include <vector>

namespace nacre::calibrate::internal {

/// What the pictures of one channel say of each spot's power.
struct SpotPowers {
  std::vector<std::vector<double>> pictures;  ///< Σ rate · footprint of each spot
  double noise = 0;          ///< relative variance of one of those, the sensor's own
  double spread = 0;         ///< of the spots' means, relative
  double sampling = 0;       ///< relative variance that a mosaic's gaps add to it
  double pixels_a_spot = 1;  ///< over so many its light is spread
};

/// Averages over channels of what the light's noise is.
class LightNoiseSums {
 public:
  /// `ways`: 2 if every other picture visits the lattice the other way round.
  void Add(const SpotPowers& powers, std::size_t ways);
  LightNoise Result() const;

 private:
  double ripple2_ = 0;
  double ripple2_variance_ = 0;
  double speckle2_ = 0;
  double speckle_channels_ = 0;
  double channels_ = 0;
};

}  // namespace nacre::calibrate::internal

#pragma once

#include "acquire/camera.h"
#include "calibrate/calibration.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// Count rates above dark, counts per µs, a value a pixel, and their variances;
/// a variance below 0 marks a pixel that saturates in every exposure.
struct RateFrame {
  std::vector<float> rate;
  std::vector<float> variance;
  std::int64_t saturated_count = 0;
};

/// Merges exposures of one scene (any order) into rates: the mean weighted by the
/// inverse variances of the noise model at the rate that all usable exposures agree on,
/// which is the maximum-likelihood estimate [Hasinoff10].
RateFrame MergeExposures(std::span<const acquire::Frame> frames,
                         const calibrate::Calibration& calibration);

}  // namespace nacre::reconstruct::internal

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
/// which is the maximum-likelihood estimate [Hasinoff10]. Counts are made linear, what
/// overflowing pixels spoil is left out, hot pixels are the mean of their neighbours.
/// `rates` is overwritten, and so are counts that overflowing pixels spoil.
void MergeExposures(std::span<acquire::Frame> frames,
                    const calibrate::Calibration& calibration,
                    RateFrame& rates);

/// The same of frames that stay.
inline RateFrame MergeExposures(std::span<const acquire::Frame> frames,
                                const calibrate::Calibration& calibration) {
  std::vector<acquire::Frame> own(frames.begin(), frames.end());
  RateFrame rates;
  MergeExposures(own, calibration, rates);
  return rates;
}

}  // namespace nacre::reconstruct::internal

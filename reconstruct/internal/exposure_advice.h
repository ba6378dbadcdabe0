#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/rd_dataset.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace nacre::reconstruct::internal {

/// Which values a longer exposure would do good: those that are so dim that at the
/// longest exposure the sensor's noise in a pixel is more than that of its photons.
class ExposureAdvice {
 public:
  /// Valid values, and those of them that need a 2^k to 2^(k+1) times longer exposure
  /// for their photons' noise to be as large as the sensor's.
  struct Counts {
    static constexpr int kOctaves = 8;
    std::int64_t valid = 0;
    std::array<std::int64_t, kOctaves> dim{};

    void Add(const Counts& other);
  };

  ExposureAdvice(const calibrate::Calibration& calibration,
                 const RdHeader& header,
                 const std::vector<double>& exposures_us);

  Counts Look(const RdSlice& slice) const;

  /// "read-noise-limited: sentence" with an exposure that leaves half of these values
  /// at most, and what it costs in pictures; empty if they are few.
  std::string Warning(const Counts& counts) const;

 private:
  std::vector<float> limit_;  // a channel: R_d where both noises are alike
  std::size_t window_size_;
  double longest_us_;
  std::size_t exposure_count_;
};

}  // namespace nacre::reconstruct::internal

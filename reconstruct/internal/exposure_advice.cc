#include "reconstruct/internal/exposure_advice.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

namespace nacre::reconstruct::internal {

void ExposureAdvice::Counts::Add(const Counts& other) {
  valid += other.valid;
  for (std::size_t k = 0; k < dim.size(); ++k) {
    dim[k] += other.dim[k];
  }
}

ExposureAdvice::ExposureAdvice(const calibrate::Calibration& calibration,
                               const RdHeader& header,
                               const std::vector<double>& exposures_us)
    : window_size_(static_cast<std::size_t>(header.WindowSize())),
      longest_us_(*std::max_element(exposures_us.begin(), exposures_us.end())),
      exposure_count_(exposures_us.size()) {
  // Counts above dark whose photons are as noisy as the sensor.
  const double sensor = calibration.VarianceCounts2(0);
  const double counts = sensor / (calibration.VarianceCounts2(1) - sensor);
  for (int c = 0; c < static_cast<int>(header.channels.size()); ++c) {
    limit_.push_back(static_cast<float>(
        counts / longest_us_ * calibration.RdPerRate(c, {0, 0}, {0, 0}, header.eta)));
  }
}

ExposureAdvice::Counts ExposureAdvice::Look(const RdSlice& slice) const {
  Counts counts;
  for (std::size_t at = 0; at < slice.rd.size(); ++at) {
    if (slice.valid[at] == 0) {
      continue;
    }
    ++counts.valid;
    const float limit = limit_[at / window_size_];
    if (slice.rd[at] < limit) {
      // What noise made negative or nothing needs more than any exposure gives.
      const double times =
          slice.rd[at] > 0 ? static_cast<double>(limit / slice.rd[at]) : 1e9;
      const int octave =
          std::min(Counts::kOctaves - 1, static_cast<int>(std::log2(times)));
      ++counts.dim[static_cast<std::size_t>(octave)];
    }
  }
  return counts;
}

std::string ExposureAdvice::Warning(const Counts& counts) const {
  constexpr double kMany = 0.25;
  const auto valid = static_cast<double>(std::max<std::int64_t>(1, counts.valid));
  std::int64_t left =
      std::accumulate(counts.dim.begin(), counts.dim.end(), std::int64_t{0});
  const std::int64_t all = left;
  if (static_cast<double>(all) < kMany * valid) {
    return "";
  }
  double times = 1;
  for (const std::int64_t dim : counts.dim) {
    if (2 * left <= all) {
      break;
    }
    left -= dim;
    times *= 2;
  }
  return fmt::format(
      "read-noise-limited: {:.0f} % of the values are so dim that at {:.4g} ms the "
      "sensor's noise is more than their photons'; {:.4g} ms beside the present "
      "exposures would leave {:.0f} %, for {:.0f} % more pictures",
      100 * static_cast<double>(all) / valid,
      1e-3 * longest_us_,
      1e-3 * times * longest_us_,
      100 * static_cast<double>(left) / valid,
      100.0 / static_cast<double>(exposure_count_));
}

}  // namespace nacre::reconstruct::internal

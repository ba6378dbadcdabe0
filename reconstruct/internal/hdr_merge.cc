#include "reconstruct/internal/hdr_merge.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

struct Bracket {
  const std::uint16_t* counts;
  double exposure_us;
  double dark_counts;
};

struct Estimate {
  double rate = 0;
  double variance = -1;
};

// A pixel that is expected this close to saturation is judged by its shorter exposures:
// picking exposures by whether noise let them pass would lower the mean.
constexpr double kMarginSigmas = 4;

// The weights are those of the rate found so far, not of each exposure's own counts:
// weights that go with the noise would favour the exposures where it was low.
Estimate Merge(std::span<const Bracket> brackets,
               std::size_t pixel,
               const calibrate::Calibration& calibration) {
  double signal = 0;
  double variance = 0;
  double exposure = 0;
  std::size_t used = 0;
  for (const Bracket& bracket : brackets) {  // shortest first
    const double counts = bracket.counts[pixel];
    if (counts >= calibration.saturation_counts) {
      break;
    }
    if (used > 0) {
      const double ratio = bracket.exposure_us / exposure;
      const double expected = std::max(0.0, signal) * ratio;
      const double sigma =
          std::sqrt(variance * ratio * ratio + calibration.VarianceCounts2(expected));
      if (bracket.dark_counts + expected + kMarginSigmas * sigma >=
          calibration.saturation_counts) {
        break;
      }
    }
    const double above = counts - bracket.dark_counts;
    signal += above;
    variance += calibration.VarianceCounts2(std::max(0.0, above));
    exposure += bracket.exposure_us;
    ++used;
  }
  if (used == 0) {
    return {};
  }
  const double pooled = std::max(0.0, signal / exposure);
  double weights = 0;
  double sum = 0;
  for (const Bracket& bracket : brackets.first(used)) {
    const double t = bracket.exposure_us;
    const double weight = t * t / calibration.VarianceCounts2(pooled * t);
    weights += weight;
    sum += weight * (bracket.counts[pixel] - bracket.dark_counts) / t;
  }
  return {sum / weights, 1 / weights};
}

}  // namespace

RateFrame MergeExposures(std::span<const acquire::Frame> frames,
                         const calibrate::Calibration& calibration) {
  Expect(!frames.empty(), "at least one exposure");
  std::vector<Bracket> brackets;
  for (const acquire::Frame& frame : frames) {
    Expect(frame.counts.size() == frames[0].counts.size(), "frames of one size");
    brackets.push_back({frame.counts.data(),
                        frame.exposure_us,
                        calibration.dark.Counts(frame.exposure_us)});
  }
  std::stable_sort(brackets.begin(), brackets.end(), [](const auto& a, const auto& b) {
    return a.exposure_us < b.exposure_us;
  });
  const std::size_t pixels = frames[0].counts.size();
  RateFrame merged{std::vector<float>(pixels), std::vector<float>(pixels)};
  for (std::size_t p = 0; p < pixels; ++p) {
    const Estimate estimate = Merge(brackets, p, calibration);
    merged.rate[p] = static_cast<float>(estimate.rate);
    merged.variance[p] = static_cast<float>(estimate.variance);
    merged.saturated_count += estimate.variance < 0 ? 1 : 0;
  }
  return merged;
}

}  // namespace nacre::reconstruct::internal

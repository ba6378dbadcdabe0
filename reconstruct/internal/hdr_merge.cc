#include "reconstruct/internal/hdr_merge.h"

#include "core/error.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// A pixel that is expected this close to saturation is judged by its shorter exposures:
// picking exposures by whether noise let them pass would lower the mean.
constexpr float kMarginSigmas = 4;

// Pixels are taken in blocks that stay in the cache through all steps.
constexpr std::size_t kBlock = 1024;
using Block = std::array<float, kBlock>;

struct Bracket {
  const std::uint16_t* counts;
  float exposure_us;
  float dark_counts;
  float shorter_us;  ///< sum of the shorter exposures
  float order;       ///< 0 for the shortest, 1 for the next, …
};

// The noise model of the calibration: variance = signal · slope + floor.
struct Noise {
  float slope;
  float floor;
  float saturation_counts;
};

// Sums over the exposures that a pixel can use, shortest first; the first unusable one
// ends it. Then sums over the same, weighted.
struct Sums {
  Block signal;
  Block variance;
  Block used;  ///< number of exposures
  Block exposure_us;
  Block pooled_rate;
  Block weighted_rate;
  Block weight;
};

__attribute__((target_clones("avx512f", "avx2", "default"))) void AddBracket(
    Bracket bracket, Noise noise, std::size_t count, Sums& sums) {
  const float first = bracket.order == 0.0F ? 1.0F : 0.0F;
  const float ratio =
      bracket.shorter_us > 0 ? bracket.exposure_us / bracket.shorter_us : 0;
  constexpr float kMargin2 = kMarginSigmas * kMarginSigmas;
  for (std::size_t k = 0; k < count; ++k) {
    const auto raw = static_cast<float>(bracket.counts[k]);
    const float above = raw - bracket.dark_counts;
    const float expected = std::max(0.0F, sums.signal[k]) * ratio;
    const float variance =
        sums.variance[k] * ratio * ratio + expected * noise.slope + noise.floor;
    const float room = noise.saturation_counts - bracket.dark_counts - expected;
    // Conditions as 0 and 1, which the compiler makes masks of.
    const float far = room * std::abs(room) > kMargin2 * variance ? 1.0F : first;
    const float dark = raw < noise.saturation_counts ? 1.0F : 0.0F;
    const float going_on = sums.used[k] == bracket.order ? 1.0F : 0.0F;
    const float one = far * dark * going_on;
    sums.signal[k] += one * above;
    sums.variance[k] += one * (std::max(0.0F, above) * noise.slope + noise.floor);
    sums.used[k] += one;
    sums.exposure_us[k] += one * bracket.exposure_us;
  }
}

// The weights are those of the rate that all exposures agree on, not of each one's own
// counts: weights that go with the noise would favour the exposures where it was low.
__attribute__((target_clones("avx512f", "avx2", "default"))) void AddWeighted(
    Bracket bracket, Noise noise, std::size_t count, Sums& sums) {
  const float t = bracket.exposure_us;
  for (std::size_t k = 0; k < count; ++k) {
    const float one = sums.used[k] > bracket.order ? 1.0F : 0.0F;
    const float weight =
        one * t * t / (sums.pooled_rate[k] * t * noise.slope + noise.floor);
    const float above = static_cast<float>(bracket.counts[k]) - bracket.dark_counts;
    sums.weight[k] += weight;
    sums.weighted_rate[k] += weight * (above / t);
  }
}

constexpr float kTiny = 1e-30F;  // in place of 0, where a pixel has no exposure

void MergeBlock(std::span<const Bracket> brackets,
                Noise noise,
                std::size_t begin,
                std::size_t count,
                RateFrame& merged) {
  Sums sums{};
  const auto add = [&](auto&& add_one) {
    for (Bracket bracket : brackets) {
      bracket.counts += begin;
      add_one(bracket, noise, count, sums);
    }
  };
  add(AddBracket);
  for (std::size_t k = 0; k < count; ++k) {
    sums.pooled_rate[k] =
        std::max(0.0F, sums.signal[k] / std::max(sums.exposure_us[k], kTiny));
  }
  add(AddWeighted);
  float saturated = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const float variance = 1 / std::max(sums.weight[k], kTiny);
    merged.rate[begin + k] = sums.weighted_rate[k] * variance;
    merged.variance[begin + k] = sums.used[k] > 0 ? variance : -1.0F;
    saturated += sums.used[k] > 0 ? 0.0F : 1.0F;
  }
  merged.saturated_count += static_cast<std::int64_t>(saturated);
}

}  // namespace

RateFrame MergeExposures(std::span<const acquire::Frame> frames,
                         const calibrate::Calibration& calibration) {
  Expect(!frames.empty(), "at least one exposure");
  std::vector<Bracket> brackets;
  for (const acquire::Frame& frame : frames) {
    Expect(frame.counts.size() == frames[0].counts.size(), "frames of one size");
    brackets.push_back({frame.counts.data(),
                        static_cast<float>(frame.exposure_us),
                        static_cast<float>(calibration.dark.Counts(frame.exposure_us)),
                        0.0F,
                        0.0F});
  }
  std::stable_sort(brackets.begin(), brackets.end(), [](const auto& a, const auto& b) {
    return a.exposure_us < b.exposure_us;
  });
  for (std::size_t b = 1; b < brackets.size(); ++b) {
    brackets[b].shorter_us = brackets[b - 1].shorter_us + brackets[b - 1].exposure_us;
    brackets[b].order = static_cast<float>(b);
  }
  const double floor = calibration.VarianceCounts2(0);
  const Noise noise{static_cast<float>(calibration.VarianceCounts2(1) - floor),
                    static_cast<float>(floor),
                    static_cast<float>(calibration.saturation_counts)};
  const std::size_t pixels = frames[0].counts.size();
  RateFrame merged{std::vector<float>(pixels), std::vector<float>(pixels)};
  for (std::size_t begin = 0; begin < pixels; begin += kBlock) {
    MergeBlock(brackets, noise, begin, std::min(kBlock, pixels - begin), merged);
  }
  return merged;
}

}  // namespace nacre::reconstruct::internal

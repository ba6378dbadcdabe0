#include "core/simd_clones.h"
#include "reconstruct/internal/merge_kernels.h"

#include <algorithm>
#include <array>

namespace nacre::reconstruct::internal {
namespace {

// Pixels are taken in blocks that stay in the cache through all steps.
constexpr std::size_t kManyBlock = 1024;
using ManyBlock = std::array<float, kManyBlock>;

// Sums over the exposures that a pixel can use, shortest first; the first unusable one
// ends it. Then sums over the same, weighted.
struct Sums {
  ManyBlock signal;
  ManyBlock variance;
  ManyBlock used;  ///< number of exposures
  ManyBlock exposure_us;
  ManyBlock pooled_rate;
  ManyBlock weighted_rate;
  ManyBlock weight;
};

NACRE_SIMD_CLONES void AddBracket(Bracket bracket,
                                  Noise noise,
                                  std::size_t count,
                                  Sums& sums) {
  const float first = bracket.order == 0.0F ? 1.0F : 0.0F;
  const float ratio = bracket.Ratio();
  constexpr float kMargin2 = kMarginSigmas * kMarginSigmas;
  for (std::size_t k = 0; k < count; ++k) {
    const auto raw = static_cast<float>(bracket.counts[k]);
    const float above = noise.Linear(raw - bracket.dark_counts);
    const float expected = std::max(0.0F, sums.signal[k]) * ratio;
    const float variance =
        sums.variance[k] * ratio * ratio + expected * noise.slope + bracket.floor;
    const float room = bracket.room - expected;
    // Conditions as 0 and 1, which the compiler makes masks of.
    const float far = room * std::abs(room) > kMargin2 * variance ? 1.0F : first;
    const float dark = raw < noise.saturation_counts ? 1.0F : 0.0F;
    const float going_on = sums.used[k] == bracket.order ? 1.0F : 0.0F;
    const float one = far * dark * going_on;
    sums.signal[k] += one * above;
    sums.variance[k] += one * (std::max(0.0F, above) * noise.slope + bracket.floor);
    sums.used[k] += one;
    sums.exposure_us[k] += one * bracket.exposure_us;
  }
}

// The weights are those of the rate that all exposures agree on, not of each one's own
// counts: weights that go with the noise would favour the exposures where it was low.
NACRE_SIMD_CLONES void AddWeighted(Bracket bracket,
                                   Noise noise,
                                   std::size_t count,
                                   Sums& sums) {
  const float t = bracket.exposure_us;
  for (std::size_t k = 0; k < count; ++k) {
    const float one = sums.used[k] > bracket.order ? 1.0F : 0.0F;
    const float expected = sums.pooled_rate[k] * t;
    const float there =
        (expected * noise.slope + bracket.floor) * noise.Stretch(expected);
    const float d = one > 0 ? there : 1.0F;
    const float weight = one * t * t / d;
    const float above =
        noise.Linear(static_cast<float>(bracket.counts[k]) - bracket.dark_counts);
    sums.weight[k] += weight;
    sums.weighted_rate[k] += weight * (above * (1 / t));
  }
}

constexpr float kTiny = 1e-30F;  // in place of 0, where a pixel has no exposure

void MergeBlock(std::span<const Bracket> brackets,
                Noise noise,
                std::size_t begin,
                std::size_t count,
                RateFrame& merged) {
  Sums sums;  // 28 kB, of which only what is in use is set to 0
  for (ManyBlock* block : {&sums.signal,
                           &sums.variance,
                           &sums.used,
                           &sums.exposure_us,
                           &sums.weighted_rate,
                           &sums.weight}) {
    std::fill_n(block->begin(), count, 0.0F);
  }
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

void MergeMany(std::span<const Bracket> brackets, Noise noise, RateFrame& merged) {
  const std::size_t pixels = merged.rate.size();
  merged.saturated_count = 0;
  for (std::size_t begin = 0; begin < pixels; begin += kManyBlock) {
    MergeBlock(brackets, noise, begin, std::min(kManyBlock, pixels - begin), merged);
  }
}

}  // namespace nacre::reconstruct::internal

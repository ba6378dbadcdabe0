#include "core/error.h"
#include "reconstruct/internal/merge_kernels.h"

#include <algorithm>
#include <array>

namespace nacre::reconstruct::internal {
namespace {

// What is done a pixel is said in MergeMany. `kCount` is known to the compiler, so that
// loops over exposures are unrolled and that over pixels is made of vectors; conditions
// are 0 and 1, which it makes masks of. Divisions are what takes long: one does for all
// weights, which are brought to one denominator.
template <std::size_t kCount>
[[gnu::always_inline]] inline void MergeOf(std::span<const Bracket> brackets,
                                           Noise noise,
                                           std::span<float> rates,
                                           std::span<float> variances) {
  constexpr float kMargin2 = kMarginSigmas * kMarginSigmas;
  constexpr float kTiny = 1e-30F;  // in place of 0, where a pixel has no exposure
  std::array<Bracket, kCount> all;
  std::copy_n(brackets.begin(), kCount, all.begin());
  const float longest_us = all[kCount - 1].exposure_us;
  float* __restrict rate_out = rates.data();
  float* __restrict variance_out = variances.data();
  const std::size_t pixels = rates.size();
  for (std::size_t k = 0; k < pixels; ++k) {
    float signal = 0;
    float pooled_variance = 0;
    float per_us = 0;  // of all exposures used
    float going_on = 1;
    float above[kCount];
    float uses[kCount];
    for (std::size_t b = 0; b < kCount; ++b) {
      const float ratio = all[b].Ratio();
      const auto raw = static_cast<float>(all[b].counts[k]);
      above[b] = noise.Linear(raw - all[b].dark_counts);
      const float expected = std::max(0.0F, signal) * ratio;
      const float variance =
          pooled_variance * ratio * ratio + expected * noise.slope + all[b].floor;
      const float room = all[b].room - expected;
      const float far = room * std::abs(room) > kMargin2 * variance ? 1.0F : 0.0F;
      const float dark = raw < noise.saturation_counts ? 1.0F : 0.0F;
      going_on *= (b == 0 ? 1.0F : far) * dark;
      uses[b] = going_on;
      signal += going_on * above[b];
      pooled_variance +=
          going_on * (std::max(0.0F, above[b]) * noise.slope + all[b].floor);
      const float sum_us = all[b].shorter_us + all[b].exposure_us;
      per_us = going_on > 0 ? 1 / sum_us : per_us;
    }
    const float pooled = std::max(0.0F, signal * per_us);
    // Σ n / d, Σ n x / d as fractions over the product of all d.
    float weights = 0;
    float weighted = 0;
    float product = 1;
    for (std::size_t b = 0; b < kCount; ++b) {
      const float t = all[b].exposure_us;
      const float expected = pooled * t;
      const float d = (expected * noise.slope + all[b].floor) * noise.Stretch(expected);
      const float n = uses[b] * (t / longest_us) * (t / longest_us) * product;
      weights = weights * d + n;
      weighted = weighted * d + n * (above[b] * (1 / t));
      product *= d;
    }
    const float inverse = 1 / std::max(weights, kTiny);
    const float variance = product * inverse * (1 / (longest_us * longest_us));
    rate_out[k] = weighted * inverse;
    variance_out[k] = uses[0] > 0 ? variance : -1.0F;
  }
}

__attribute__((target_clones("avx512f", "avx2", "default"))) void MergeOne(
    std::span<const Bracket> brackets,
    Noise noise,
    std::span<float> rates,
    std::span<float> variances) {
  MergeOf<1>(brackets, noise, rates, variances);
}

__attribute__((target_clones("avx512f", "avx2", "default"))) void MergeTwo(
    std::span<const Bracket> brackets,
    Noise noise,
    std::span<float> rates,
    std::span<float> variances) {
  MergeOf<2>(brackets, noise, rates, variances);
}

__attribute__((target_clones("avx512f", "avx2", "default"))) void MergeThree(
    std::span<const Bracket> brackets,
    Noise noise,
    std::span<float> rates,
    std::span<float> variances) {
  MergeOf<3>(brackets, noise, rates, variances);
}

__attribute__((target_clones("avx512f", "avx2", "default"))) void MergeFour(
    std::span<const Bracket> brackets,
    Noise noise,
    std::span<float> rates,
    std::span<float> variances) {
  MergeOf<4>(brackets, noise, rates, variances);
}

__attribute__((target_clones("avx512f", "avx2", "default"))) std::int64_t CountBelow0(
    std::span<const float> values) {
  std::int64_t count = 0;
  for (const float value : values) {
    count += value < 0 ? 1 : 0;
  }
  return count;
}

}  // namespace

void MergeFew(std::span<const Bracket> brackets, Noise noise, RateFrame& merged) {
  Expect(!brackets.empty() && brackets.size() <= kFewExposures, "a few exposures");
  constexpr std::array kMerge = {MergeOne, MergeTwo, MergeThree, MergeFour};
  kMerge[brackets.size() - 1](brackets, noise, merged.rate, merged.variance);
  merged.saturated_count = CountBelow0(merged.variance);
}

}  // namespace nacre::reconstruct::internal

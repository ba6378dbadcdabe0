#include "core/error.h"
#include "core/simd_clones.h"
#include "reconstruct/internal/merge_kernels.h"

#include <algorithm>
#include <array>

namespace nacre::reconstruct::internal {
namespace {

// Pixels whose counts are made floats at a time: 2 kB an exposure.
constexpr std::size_t kFewBlock = 512;
using FewBlock = std::array<float, kFewBlock>;

struct Result {
  float* rate;
  float* variance;
};

// What is done a pixel is said in MergeMany. `kCount` is known to the compiler, so that
// loops over exposures are unrolled and that over pixels is made of vectors; conditions
// are 0 and 1, which it makes masks of. Divisions are what takes long: one does for all
// weights, which are brought to one denominator.
template <std::size_t kCount>
[[gnu::always_inline]] inline void MergeOf(const Bracket* brackets,
                                           const FewBlock* counts,
                                           Noise noise,
                                           std::size_t pixels,
                                           Result result) {
  constexpr float kMargin2 = kMarginSigmas * kMarginSigmas;
  constexpr float kTiny = 1e-30F;  // in place of 0, where a pixel has no exposure
  std::array<Bracket, kCount> all;
  std::copy_n(brackets, kCount, all.begin());
  const float longest_us = all[kCount - 1].exposure_us;
  float* __restrict rate_out = result.rate;
  float* __restrict variance_out = result.variance;
  for (std::size_t k = 0; k < pixels; ++k) {
    float signal = 0;
    float pooled_variance = 0;
    float per_us = 0;  // of all exposures used
    float going_on = 1;
    float above[kCount];
    float uses[kCount];
    for (std::size_t b = 0; b < kCount; ++b) {
      const float ratio = all[b].Ratio();
      const float raw = counts[b][k];
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
      const float there =
          (expected * noise.slope + all[b].floor) * noise.Stretch(expected);
      // Far beyond saturation the response is nothing to count on, nor a float.
      const float d = uses[b] > 0 ? there : 1.0F;
      const float n = uses[b] * ((t / longest_us) * (t / longest_us)) * product;
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

NACRE_SIMD_CLONES void MergeOne(const Bracket* brackets,
                                const FewBlock* counts,
                                Noise noise,
                                std::size_t pixels,
                                Result result) {
  MergeOf<1>(brackets, counts, noise, pixels, result);
}

NACRE_SIMD_CLONES void MergeTwo(const Bracket* brackets,
                                const FewBlock* counts,
                                Noise noise,
                                std::size_t pixels,
                                Result result) {
  MergeOf<2>(brackets, counts, noise, pixels, result);
}

NACRE_SIMD_CLONES void MergeThree(const Bracket* brackets,
                                  const FewBlock* counts,
                                  Noise noise,
                                  std::size_t pixels,
                                  Result result) {
  MergeOf<3>(brackets, counts, noise, pixels, result);
}

NACRE_SIMD_CLONES void MergeFour(const Bracket* brackets,
                                 const FewBlock* counts,
                                 Noise noise,
                                 std::size_t pixels,
                                 Result result) {
  MergeOf<4>(brackets, counts, noise, pixels, result);
}

NACRE_SIMD_CLONES void ToFloats(const std::uint16_t* __restrict counts,
                                std::size_t count,
                                float* __restrict floats) {
  for (std::size_t k = 0; k < count; ++k) {
    floats[k] = static_cast<float>(counts[k]);
  }
}

NACRE_SIMD_CLONES std::int64_t CountBelow0(std::span<const float> values) {
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
  const std::size_t pixels = merged.rate.size();
  std::array<FewBlock, kFewExposures> counts;
  for (std::size_t begin = 0; begin < pixels; begin += kFewBlock) {
    const std::size_t count = std::min(kFewBlock, pixels - begin);
    for (std::size_t b = 0; b < brackets.size(); ++b) {
      ToFloats(brackets[b].counts + begin, count, counts[b].data());
    }
    kMerge[brackets.size() - 1](brackets.data(),
                                counts.data(),
                                noise,
                                count,
                                {&merged.rate[begin], &merged.variance[begin]});
  }
  merged.saturated_count = CountBelow0(merged.variance);
}

}  // namespace nacre::reconstruct::internal

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
  float floor;       ///< variance without light, counts²
  float room;        ///< linear counts between dark and saturation
};

// The noise model of the calibration: variance = signal · slope + floor; and the
// response's curvature, linear = counts (1 + b1 counts + b2 counts²).
struct Noise {
  float slope;
  float saturation_counts;
  float b1;
  float b2;

  [[gnu::always_inline]] float Linear(float counts) const {
    return counts * (1.0F + counts * (b1 + counts * b2));
  }
  // What the curvature makes of a variance, to first order.
  [[gnu::always_inline]] float Stretch(float counts) const {
    const float slope_there = 1.0F + counts * (2 * b1 + 3 * counts * b2);
    return slope_there * slope_there;
  }
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
__attribute__((target_clones("avx512f", "avx2", "default"))) void AddWeighted(
    Bracket bracket, Noise noise, std::size_t count, Sums& sums) {
  const float t = bracket.exposure_us;
  for (std::size_t k = 0; k < count; ++k) {
    const float one = sums.used[k] > bracket.order ? 1.0F : 0.0F;
    const float expected = sums.pooled_rate[k] * t;
    const float weight =
        one * t * t /
        ((expected * noise.slope + bracket.floor) * noise.Stretch(expected));
    const float above =
        noise.Linear(static_cast<float>(bracket.counts[k]) - bracket.dark_counts);
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
  Sums sums;  // 28 kB, of which only what is in use is set to 0
  for (Block* block : {&sums.signal,
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

// Counts beside pixels that overflow hold what spilt over: they are made to look
// saturated, which leaves them out.
void SpreadSaturation(const calibrate::Blooming& blooming,
                      double saturation_counts,
                      acquire::Frame& frame) {
  constexpr std::uint16_t kFull = 0xFFFF;
  const auto mark = [&](int x, int y) {
    if (x >= 0 && x < frame.width && y >= 0 && y < frame.height) {
      frame.counts[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                   static_cast<std::size_t>(x)] = kFull;
    }
  };
  std::vector<std::size_t> full;
  const int saturation = static_cast<int>(std::ceil(saturation_counts));
  for (std::size_t k = 0; k < frame.counts.size(); ++k) {
    if (frame.counts[k] >= saturation) {
      full.push_back(k);
    }
  }
  for (const std::size_t k : full) {
    const int x = static_cast<int>(k) % frame.width;
    const int y = static_cast<int>(k) / frame.width;
    for (int d = -blooming.reach_px; d <= blooming.reach_px; ++d) {
      mark(x, y + d);
    }
    for (int d = -blooming.side_reach_px; d <= blooming.side_reach_px; ++d) {
      mark(x + d, y);
    }
  }
}

__attribute__((target_clones("avx2", "default"))) std::uint16_t MostCounts(
    const std::vector<std::uint16_t>& pixels) {
  std::uint16_t most = 0;
  for (const std::uint16_t counts : pixels) {
    most = most < counts ? counts : most;
  }
  return most;
}

// A hot pixel's noise is beyond the model; what its neighbours saw stands for it.
void FillHotPixels(const calibrate::Calibration& calibration, RateFrame& rates) {
  const int width = calibration.camera.width_px;
  // In a mosaic the nearest of the same colour.
  const int step = calibration.corrections.filters.mosaic.empty() ? 1 : 2;
  const auto pixels = static_cast<std::int64_t>(rates.rate.size());
  std::vector<char> hot(rates.rate.size(), 0);
  for (const calibrate::HotPixel& pixel : calibration.corrections.hot_pixels) {
    hot[static_cast<std::size_t>(pixel.index)] = 1;
  }
  for (const calibrate::HotPixel& pixel : calibration.corrections.hot_pixels) {
    float rate = 0;
    float variance = 0;
    float count = 0;
    const auto add = [&](std::int64_t k) {
      if (k >= 0 && k < pixels && hot[static_cast<std::size_t>(k)] == 0 &&
          rates.variance[static_cast<std::size_t>(k)] >= 0) {
        rate += rates.rate[static_cast<std::size_t>(k)];
        variance += rates.variance[static_cast<std::size_t>(k)];
        count += 1;
      }
    };
    const int x = pixel.index % width;
    if (x >= step && x + step < width) {
      add(pixel.index - step);
      add(pixel.index + step);
    }
    add(pixel.index - std::int64_t{step} * width);
    add(pixel.index + std::int64_t{step} * width);
    const auto at = static_cast<std::size_t>(pixel.index);
    rates.rate[at] = count > 0 ? rate / count : 0.0F;
    rates.variance[at] = count > 0 ? variance / count : -1.0F;
  }
}

std::vector<Bracket> MakeBrackets(std::span<const acquire::Frame> frames,
                                  const calibrate::Calibration& calibration) {
  const calibrate::Corrections& corrections = calibration.corrections;
  std::vector<Bracket> brackets;
  for (const acquire::Frame& frame : frames) {
    Expect(frame.counts.size() == frames[0].counts.size(), "frames of one size");
    const double dark = calibration.dark.Counts(frame.exposure_us);
    const double spread = corrections.dark_spread_counts_per_us * frame.exposure_us;
    const double floor = calibration.VarianceCounts2(0) + spread * spread +
                         corrections.row_noise_counts * corrections.row_noise_counts;
    brackets.push_back({frame.counts.data(),
                        static_cast<float>(frame.exposure_us),
                        static_cast<float>(dark),
                        0.0F,
                        0.0F,
                        static_cast<float>(floor),
                        static_cast<float>(corrections.linearity.Linear(
                            calibration.saturation_counts - dark))});
  }
  std::stable_sort(brackets.begin(), brackets.end(), [](const auto& a, const auto& b) {
    return a.exposure_us < b.exposure_us;
  });
  for (std::size_t b = 1; b < brackets.size(); ++b) {
    brackets[b].shorter_us = brackets[b - 1].shorter_us + brackets[b - 1].exposure_us;
    brackets[b].order = static_cast<float>(b);
  }
  return brackets;
}

}  // namespace

void MergeExposures(std::span<acquire::Frame> frames,
                    const calibrate::Calibration& calibration,
                    RateFrame& rates) {
  Expect(!frames.empty(), "at least one exposure");
  const calibrate::Corrections& corrections = calibration.corrections;
  const bool blooms =
      corrections.blooming.reach_px > 0 || corrections.blooming.side_reach_px > 0;
  for (acquire::Frame& frame : frames) {
    if (blooms && MostCounts(frame.counts) >= calibration.saturation_counts) {
      SpreadSaturation(corrections.blooming, calibration.saturation_counts, frame);
    }
  }
  const std::vector<Bracket> brackets = MakeBrackets(frames, calibration);
  const Noise noise{static_cast<float>(calibration.VarianceCounts2(1) -
                                       calibration.VarianceCounts2(0)),
                    static_cast<float>(calibration.saturation_counts),
                    static_cast<float>(corrections.linearity.b1_per_count),
                    static_cast<float>(corrections.linearity.b2_per_count2)};
  const std::size_t pixels = frames[0].counts.size();
  rates.rate.resize(pixels);
  rates.variance.resize(pixels);
  rates.saturated_count = 0;
  for (std::size_t begin = 0; begin < pixels; begin += kBlock) {
    MergeBlock(brackets, noise, begin, std::min(kBlock, pixels - begin), rates);
  }
  if (!corrections.hot_pixels.empty()) {
    FillHotPixels(calibration, rates);
  }
}

}  // namespace nacre::reconstruct::internal

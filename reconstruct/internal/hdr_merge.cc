#include "reconstruct/internal/hdr_merge.h"

#include "core/error.h"
#include "core/simd_clones.h"
#include "reconstruct/internal/merge_kernels.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

NACRE_AVX2_CLONES std::uint16_t MostCounts(std::span<const std::uint16_t> pixels) {
  std::uint16_t most = 0;
  for (const std::uint16_t counts : pixels) {
    most = most < counts ? counts : most;
  }
  return most;
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
  // Few overflow: stretches without any are passed by.
  constexpr std::size_t kStretch = 1024;
  std::vector<std::size_t> full;
  const int saturation = static_cast<int>(std::ceil(saturation_counts));
  for (std::size_t begin = 0; begin < frame.counts.size(); begin += kStretch) {
    const std::size_t end = std::min(begin + kStretch, frame.counts.size());
    if (MostCounts(std::span(frame.counts).subspan(begin, end - begin)) < saturation) {
      continue;
    }
    for (std::size_t k = begin; k < end; ++k) {
      if (frame.counts[k] >= saturation) {
        full.push_back(k);
      }
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
    if (blooms) {
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
  if (brackets.size() <= kFewExposures) {
    MergeFew(brackets, noise, rates);
  } else {
    MergeMany(brackets, noise, rates);
  }
  if (!corrections.hot_pixels.empty()) {
    FillHotPixels(calibration, rates);
  }
}

}  // namespace nacre::reconstruct::internal

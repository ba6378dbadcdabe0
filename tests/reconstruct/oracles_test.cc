// The inner loops of the session path and of clustering against long double. Bounds are
// first-order sums of the roundings on the way, u = 2⁻²⁴ each, set before anything was
// measured [Higham02, ch. 3]; 1.01 stands for the higher orders.

#include "core/random.h"
#include "reconstruct/internal/merge_kernels.h"
#include "reconstruct/internal/nearest_centres.h"
#include "reconstruct/internal/tails.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace nacre::reconstruct::internal {
namespace {

using Wide = long double;
constexpr Wide kUnit = 0x1p-24L;

Wide W(float value) {
  return static_cast<Wide>(value);
}

// A pixel's merged rate and its variance, and what floats may make of them.
struct Merged {
  Wide rate = 0;
  Wide variance = -1;
  Wide rate_bound = 0;
  Wide variance_bound = 0;
  bool is_close = false;  // rounding may decide whether an exposure counts
};

// What MergeMany does, in long double, with the rounding of each step.
Merged MergePixel(const std::vector<Bracket>& brackets, Noise noise, std::size_t k) {
  const auto count = static_cast<Wide>(brackets.size());
  const Wide slope = W(noise.slope);
  const Wide b1 = W(noise.b1);
  const Wide b2 = W(noise.b2);
  std::vector<Wide> above;
  std::vector<Wide> above_off;
  Merged merged;
  Wide signal = 0;
  Wide signal_off = 0;
  Wide pooled = 0;
  Wide sum_us = 0;
  for (const Bracket& b : brackets) {
    const auto raw = static_cast<Wide>(b.counts[k]);
    const Wide x = raw - W(b.dark_counts);
    const Wide a = x * (1 + x * (b1 + x * b2));
    // A difference and four operations of numbers that are all below 2 x.
    const Wide off = 6 * kUnit * std::abs(a) * (1 + 2 * std::abs(x) * std::abs(b1));
    const Wide ratio = W(b.shorter_us) > 0 ? W(b.exposure_us) / W(b.shorter_us) : 0;
    const Wide expected = std::max(0.0L, signal) * ratio;
    const Wide variance = pooled * ratio * ratio + expected * slope + W(b.floor);
    const Wide room = W(b.room) - expected;
    const Wide margin =
        room * std::abs(room) - W(kMarginSigmas) * W(kMarginSigmas) * variance;
    const bool first = b.order == 0;
    const bool far = first || margin > 0;
    merged.is_close =
        merged.is_close ||
        (!first && std::abs(margin) <= 64 * kUnit * (room * room + 16 * variance));
    if (!far || raw >= W(noise.saturation_counts)) {
      break;
    }
    above.push_back(a);
    above_off.push_back(off);
    signal += a;
    signal_off += off + count * kUnit * std::abs(a);
    pooled += std::max(0.0L, a) * slope + W(b.floor);
    sum_us += W(b.exposure_us);
  }
  if (above.empty()) {
    return merged;
  }
  const Wide rate = std::max(0.0L, signal / sum_us);
  const Wide rate_off = signal_off / sum_us + 2 * kUnit * rate;
  Wide weights = 0;
  Wide weighted = 0;
  std::vector<Wide> weight;
  std::vector<Wide> weight_off;
  for (std::size_t b = 0; b < above.size(); ++b) {
    const Wide t = W(brackets[b].exposure_us);
    const Wide expected = rate * t;
    const Wide bent = 1 + expected * (2 * b1 + 3 * expected * b2);
    const Wide d = expected * slope + W(brackets[b].floor);
    weight.push_back(t * t / (d * bent * bent));
    // What the rate's error makes of d and of the bend; d has 3 roundings, the bend's
    // square 2 · 6, the weight 4.
    weight_off.push_back(slope * t * rate_off / d +
                         4 * std::abs(b1) * t * rate_off / bent + 19 * kUnit);
    weights += weight.back();
    weighted += weight.back() * above[b] / t;
  }
  merged.rate = weighted / weights;
  merged.variance = 1 / weights;
  // MergeFew brings weights to one denominator: three more products an exposure.
  const Wide sums = (4 * count + 4) * kUnit;
  Wide most_off = 0;
  for (std::size_t b = 0; b < above.size(); ++b) {
    const Wide t = W(brackets[b].exposure_us);
    const Wide share = weight[b] / weights;
    merged.rate_bound +=
        1.01L * share *
        (weight_off[b] * std::abs(above[b] / t - merged.rate) + above_off[b] / t +
         (sums + 3 * kUnit) * std::abs(above[b] / t));
    most_off = std::max(most_off, weight_off[b]);
  }
  merged.rate_bound += sums * std::abs(merged.rate);
  merged.variance_bound = 1.01L * (most_off + sums) * merged.variance;
  return merged;
}

// Twelve decades of light: exposures of 0.1 µs to 40 s, from a count above the dark of
// the longest to saturation in the shortest but one; and pixels that saturate in all.
TEST(ReconstructOracles, MergingIsThatOfLongDouble) {
  constexpr std::size_t kPixels = 4001;
  const std::vector<float> exposures_us = {0.1F, 50, 3e4F, 4e7F, 5e7F};
  const Noise noise{0.2F, 4090, 1e-6F, 1e-10F};
  RandomStream random(5, 0);
  std::vector<std::vector<std::uint16_t>> counts(exposures_us.size());
  for (std::size_t k = 0; k < kPixels; ++k) {
    const double rate = std::pow(10.0, 13 * random.Uniform() - 8);
    for (std::size_t b = 0; b < counts.size(); ++b) {
      const double mean = 60 + rate * static_cast<double>(exposures_us[b]);
      const double seen = mean + 3 * (random.Uniform() - 0.5) * std::sqrt(2 + mean / 5);
      counts[b].push_back(static_cast<std::uint16_t>(std::clamp(seen, 0.0, 4095.0)));
    }
  }
  for (std::size_t count = 1; count <= exposures_us.size(); ++count) {
    std::vector<Bracket> brackets;
    float shorter_us = 0;
    for (std::size_t b = 0; b < count; ++b) {
      brackets.push_back({counts[b].data(),
                          exposures_us[b],
                          60.0F,
                          shorter_us,
                          static_cast<float>(b),
                          2.0F,
                          4030.0F});
      shorter_us += exposures_us[b];
    }
    std::vector<RateFrame> found(
        2, RateFrame{std::vector<float>(kPixels), std::vector<float>(kPixels)});
    MergeMany(brackets, noise, found[0]);
    found[1] = found[0];
    if (count <= kFewExposures) {
      MergeFew(brackets, noise, found[1]);
    }
    int close = 0;
    for (std::size_t k = 0; k < kPixels; ++k) {
      const Merged exact = MergePixel(brackets, noise, k);
      if (exact.is_close) {
        ++close;
        continue;
      }
      for (const RateFrame& frame : found) {
        if (exact.variance < 0) {
          ASSERT_EQ(frame.variance[k], -1) << k;
          continue;
        }
        ASSERT_LE(std::abs(W(frame.rate[k]) - exact.rate), exact.rate_bound)
            << count << " exposures, pixel " << k;
        ASSERT_LE(std::abs(W(frame.variance[k]) - exact.variance), exact.variance_bound)
            << count << " exposures, pixel " << k;
      }
    }
    EXPECT_LT(close, 20);
    EXPECT_GT(found[0].saturated_count, 100);
  }
}

// To the bit the plain loop's; a square of a difference passes three roundings, a sum
// of n positive numbers n − 1.
TEST(ReconstructOracles, NearestCentresAreThoseOfLongDouble) {
  for (const int dimensions : {1, 5, 16, 24, 33}) {
    constexpr std::int64_t kPoints = 203;
    constexpr int kCentres = 19;
    RandomStream random(static_cast<std::uint64_t>(dimensions), 0);
    const auto draw = [&] {
      return static_cast<float>((random.Uniform() - 0.5) *
                                std::pow(10, -12 * random.Uniform()));
    };
    PointSet points{{}, kPoints, dimensions};
    points.values.resize(static_cast<std::size_t>(kPoints * dimensions));
    std::generate(points.values.begin(), points.values.end(), draw);
    std::vector<double> centres(static_cast<std::size_t>(kCentres * dimensions));
    std::generate(
        centres.begin(), centres.end(), [&] { return static_cast<double>(draw()); });
    std::vector<std::int64_t> which(kPoints);
    for (std::size_t n = 0; n < which.size(); ++n) {
      which[n] = std::ssize(which) - 1 - static_cast<std::int64_t>(n);
    }
    std::vector<Nearest> found(kPoints);
    NearestCentres(centres, kCentres, dimensions).Find(points, which, found);
    const std::vector<float> first(centres.begin(), centres.begin() + dimensions);
    std::vector<float> lowered(kPoints, std::numeric_limits<float>::max());
    LowerToDistance2(points, first.data(), lowered);
    for (std::size_t n = 0; n < which.size(); ++n) {
      const float* point = points.Row(which[n]);
      std::array<float, kCentres> plain{};
      std::array<Wide, kCentres> exact{};
      for (std::size_t c = 0; c < kCentres; ++c) {
        for (int d = 0; d < dimensions; ++d) {
          const auto centre =
              static_cast<float>(centres[c * static_cast<std::size_t>(dimensions) +
                                         static_cast<std::size_t>(d)]);
          plain[c] += (point[d] - centre) * (point[d] - centre);
          exact[c] += (W(point[d]) - W(centre)) * (W(point[d]) - W(centre));
        }
      }
      const Wide rounding = 1.01L * (dimensions + 2) * kUnit;
      const auto nearest = std::min_element(plain.begin(), plain.end());
      ASSERT_EQ(found[n].centre, nearest - plain.begin());
      ASSERT_EQ(std::bit_cast<std::uint32_t>(found[n].distance2),
                std::bit_cast<std::uint32_t>(*nearest));
      const Wide least = *std::min_element(exact.begin(), exact.end());
      ASSERT_LE(std::abs(W(found[n].distance2) - least), rounding * least + 1e-42L);
      ASSERT_LE(std::abs(W(lowered[static_cast<std::size_t>(which[n])]) - exact[0]),
                rounding * exact[0] + 1e-42L);
    }
  }
}

RdHeader TailHeader() {
  RdHeader header;
  header.points_x = 7;
  header.points_y = 3;
  header.core = 15;
  header.pitch_mm = 0.5;
  header.channels = {"R"};
  return header;
}

// Twelve decades from the middle of a window to its corner.
RdSlice SteepSlice(const RdHeader& header, double scale) {
  RdSlice slice = MakeSlice(header);
  for (std::size_t k = 0; k < slice.rd.size(); ++k) {
    const int cell = static_cast<int>(k);
    const PointMm d = header.Offset(cell % header.core, cell / header.core);
    slice.rd[k] = static_cast<float>(
        scale * std::exp(-12 * std::log(10.0) * std::hypot(d.x, d.y) / 4.95));
    slice.sigma[k] = 1e-3F * slice.rd[k];
  }
  return slice;
}

// ln R_d is a sum of a, κ r and ln r², each rounded on its way and as it is added; of
// two ways the mean. With |a| ≤ 69 + 28 for 10^±30, |κ r| ≤ 5.6 · 31.8 and |ln r²| ≤ 7:
// the exponent is off by 3 u of their sum, twice for two scales, and by the rounding of
// what was measured, u; the exponential by 2 u.
TEST(ReconstructOracles, TailsDoNotDependOnTheUnit) {
  const RdHeader header = TailHeader();
  std::vector<TailMap> tails;
  const std::vector<double> scales = {1, 1e-20, 1e30};
  for (const double scale : scales) {
    tails.emplace_back(header);
    for (int s = 0; s < header.PointCount(); ++s) {
      tails.back().Fit(s % 7, s / 7, SteepSlice(header, scale), 1.0);
    }
  }
  int seen = 0;
  for (int du = -12; du <= 12; ++du) {
    for (int dv = -12; dv <= 12; ++dv) {
      const Wide r = 0.5L * std::hypot(static_cast<Wide>(du), static_cast<Wide>(dv));
      const Wide one = W(tails[0].Extrapolate(3, 1, 0, du, dv));
      for (std::size_t n = 1; n < scales.size(); ++n) {
        const Wide scaled =
            W(tails[n].Extrapolate(3, 1, 0, du, dv)) / static_cast<Wide>(scales[n]);
        const Wide logs = 69 + 28 + 5.6L * r + 7;
        if (r > 0 && one * static_cast<Wide>(scales[n]) > 1e-37L) {
          ASSERT_LE(std::abs(scaled - one), (6 * logs + 4) * kUnit * one)
              << du << ' ' << dv << ' ' << scales[n];
          ++seen;
        }
      }
    }
  }
  EXPECT_GT(seen, 500);
}

// What no tail can be fitted to has none, and never what is no number.
TEST(ReconstructOracles, WhatIsNotATailIsNone) {
  RdHeader header = TailHeader();
  RdSlice dark = MakeSlice(header);
  RdSlice denormal = dark;
  RdSlice largest = dark;
  std::fill(denormal.rd.begin(), denormal.rd.end(), 1e-42F);
  std::fill(largest.rd.begin(), largest.rd.end(), std::numeric_limits<float>::max());
  RdSlice masked = SteepSlice(header, 1);
  std::fill(masked.valid.begin(), masked.valid.end(), std::uint8_t{0});
  RdSlice half = SteepSlice(header, 1);
  for (std::size_t k = 0; k < half.valid.size(); ++k) {
    half.valid[k] = k % 15 < 7 ? 0 : 1;
    half.rd[k] = k % 15 < 7 ? 1e20F : half.rd[k];
  }
  for (const RdSlice& slice : {dark, denormal, largest, masked, half}) {
    TailMap tails(header);
    tails.Fit(3, 1, slice, 1.0);
    for (int d = -40; d <= 40; ++d) {
      for (const float value :
           {tails.Extrapolate(3, 1, 0, d, 2), tails.Extrapolate(3, 1, 0, 2, d)}) {
        EXPECT_TRUE(value >= 0 && !std::isnan(value));
        EXPECT_TRUE(slice.rd != dark.rd || value == 0);
        EXPECT_TRUE(slice.rd != half.rd || value < 1) << d;
      }
    }
  }
  for (const int core : {1, 3}) {  // too small for a tail
    header.core = core;
    TailMap tails(header);
    tails.Fit(3, 1, SteepSlice(header, 1), 1.0);
    EXPECT_TRUE(std::isfinite(tails.Extrapolate(3, 1, 0, 1, 1)));
  }
}

}  // namespace
}  // namespace nacre::reconstruct::internal

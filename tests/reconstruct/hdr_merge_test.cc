// Exposures merged to rates: without bias, with the variance that is claimed.

#include "reconstruct/internal/hdr_merge.h"

#include "core/random.h"
#include "reconstruct/internal/merge_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::reconstruct::internal {
namespace {

calibrate::Calibration Calibration() {
  calibrate::Calibration calibration;
  calibration.dark = {.offset_counts = 60, .rate_counts_per_us = 1e-4};
  calibration.gain_electrons_per_count = 5;
  calibration.read_noise_electrons = 7;
  calibration.saturation_counts = 4090;
  return calibration;
}

// Normal deviates by Box and Muller; photon noise of hundreds of electrons is normal.
double Normal(RandomStream& random) {
  return std::sqrt(-2 * std::log(1 - random.Uniform())) *
         std::cos(2 * std::numbers::pi * random.Uniform());
}

acquire::Frame Expose(double rate, double exposure_us, int pixels, std::uint64_t seed) {
  const calibrate::Calibration calibration = Calibration();
  RandomStream random(seed, 0);
  acquire::Frame frame;
  frame.width = pixels;
  frame.height = 1;
  frame.exposure_us = exposure_us;
  for (int k = 0; k < pixels; ++k) {
    const double mean = rate * exposure_us;
    const double variance =
        mean / calibration.gain_electrons_per_count +
        std::pow(
            calibration.read_noise_electrons / calibration.gain_electrons_per_count, 2);
    const double counts = calibration.dark.Counts(exposure_us) + mean +
                          std::sqrt(variance) * Normal(random);
    frame.counts.push_back(
        static_cast<std::uint16_t>(std::clamp(std::round(counts), 0.0, 4095.0)));
  }
  return frame;
}

TEST(MergeExposures, MeanAndVarianceAreThoseOfTheNoise) {
  constexpr int kPixels = 20000;
  // From dim to so bright that only the shortest exposure holds it; 0.99 and 1.01 of
  // saturation in the middle one, where noise decides what saturates.
  for (const double rate : {0.0, 0.002, 0.05, 0.4, 0.3999, 0.407, 1.5, 3.9}) {
    const std::vector<acquire::Frame> frames = {Expose(rate, 10000, kPixels, 1),
                                                Expose(rate, 1000, kPixels, 2),
                                                Expose(rate, 100, kPixels, 3)};
    const RateFrame merged = MergeExposures(frames, Calibration());
    double sum = 0;
    double squares = 0;
    double variance = 0;
    for (int k = 0; k < kPixels; ++k) {
      const auto p = static_cast<std::size_t>(k);
      ASSERT_GE(merged.variance[p], 0.0F);
      sum += static_cast<double>(merged.rate[p]);
      squares += std::pow(static_cast<double>(merged.rate[p]) - rate, 2);
      variance += static_cast<double>(merged.variance[p]);
    }
    const double claimed = std::sqrt(variance / kPixels);
    EXPECT_NEAR(sum / kPixels, rate, 4 * claimed / std::sqrt(kPixels) + 1e-4 * rate)
        << "rate " << rate;
    EXPECT_NEAR(std::sqrt(squares / kPixels), claimed, 0.05 * claimed)
        << "rate " << rate;
  }
}

TEST(MergeExposures, ALongExposureHelpsWhereItDoesNotSaturate) {
  const std::vector<acquire::Frame> frames = {Expose(0.02, 10000, 100, 1),
                                              Expose(0.02, 1000, 100, 2)};
  const RateFrame both = MergeExposures(frames, Calibration());
  const RateFrame shorter = MergeExposures({&frames[1], 1}, Calibration());
  EXPECT_LT(both.variance[0], 0.2F * shorter.variance[0]);
}

TEST(MergeExposures, WhatSaturatesInAllIsMarked) {
  const std::vector<acquire::Frame> frames = {Expose(100, 10000, 1500, 1),
                                              Expose(100, 100, 1500, 2)};
  const RateFrame merged = MergeExposures(frames, Calibration());
  EXPECT_EQ(merged.saturated_count, 1500);
  EXPECT_LT(merged.variance[1400], 0.0F);
}

// The fast way against the plain one, over all that a pixel can be: dark, cut off by
// saturation in any exposure, and a number of pixels that fills no vector.
TEST(MergeFew, IsMergeMany) {
  constexpr std::size_t kPixels = 5003;
  const std::vector<float> exposures_us = {100, 1000, 8000, 40000};
  const Noise noise{0.2F, 4090, 1e-6F, 1e-10F};
  RandomStream random(5, 0);
  std::vector<std::vector<std::uint16_t>> counts(exposures_us.size());
  for (std::size_t k = 0; k < kPixels; ++k) {
    const double rate = std::pow(10.0, 5 * random.Uniform() - 3);
    for (std::size_t b = 0; b < counts.size(); ++b) {
      const double mean = 60 + rate * static_cast<double>(exposures_us[b]);
      const double seen = mean + std::sqrt(0.2 * mean + 2) * Normal(random);
      counts[b].push_back(static_cast<std::uint16_t>(std::clamp(seen, 0.0, 4095.0)));
    }
  }
  for (std::size_t count = 1; count <= kFewExposures; ++count) {
    std::vector<Bracket> brackets;
    float shorter_us = 0;
    for (std::size_t b = 0; b < count; ++b) {
      const float order = static_cast<float>(b);
      brackets.push_back(
          {counts[b].data(), exposures_us[b], 60.0F, shorter_us, order, 2.0F, 4030.0F});
      shorter_us += exposures_us[b];
    }
    RateFrame few{std::vector<float>(kPixels), std::vector<float>(kPixels)};
    RateFrame many = few;
    MergeFew(brackets, noise, few);
    MergeMany(brackets, noise, many);
    EXPECT_GT(many.saturated_count, 0);
    EXPECT_EQ(few.saturated_count, many.saturated_count);
    for (std::size_t k = 0; k < kPixels; ++k) {
      const float noise_there = std::sqrt(std::max(0.0F, many.variance[k]));
      ASSERT_NEAR(few.rate[k],
                  many.rate[k],
                  1e-4F * noise_there + 2e-6F * std::abs(many.rate[k]));
      ASSERT_NEAR(few.variance[k], many.variance[k], 2e-5F * std::abs(many.variance[k]))
          << k;
    }
  }
}

}  // namespace
}  // namespace nacre::reconstruct::internal

#include "rigs/sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace nacre::rigs {
namespace {

struct Moments {
  double mean = 0;
  double variance = 0;
  double skewness = 0;
  double neighbour_correlation = 0;
};

Moments MomentsOf(const std::vector<std::uint16_t>& counts) {
  Moments m;
  const auto n = static_cast<double>(counts.size());
  for (const std::uint16_t c : counts) {
    m.mean += c / n;
  }
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double d = counts[k] - m.mean;
    m.variance += d * d / n;
    m.skewness += d * d * d / n;
    m.neighbour_correlation += d * (counts[(k + 1) % counts.size()] - m.mean) / n;
  }
  m.skewness /= std::pow(m.variance, 1.5);
  m.neighbour_correlation /= m.variance;
  return m;
}

std::vector<std::uint16_t> Take(const SensorModel& sensor,
                                float rate,
                                const Exposure& exposure,
                                std::size_t size = 200'000,
                                int thread_count = 1) {
  const std::vector<float> rates(size, rate);
  std::vector<std::uint16_t> counts(size);
  Expose(sensor, exposure, rates, counts, thread_count);
  return counts;
}

// One electron a count and no offset: the counts are the electrons, so mean, variance
// and skewness are those of a Poisson variable plus reading and rounding. The rates
// straddle the two ways in which they are drawn.
TEST(Sensor, PhotonsAreCountedAsPoissonSays) {
  const SensorModel sensor{.full_well_electrons = 1e6,
                           .read_noise_electrons = 2,
                           .electrons_per_count = 1,
                           .offset_counts = 50,
                           .dark_electrons_per_us = 0,
                           .bit_depth = 16};
  for (const float electrons : {0.0F, 0.3F, 4.0F, 19.9F, 20.1F, 60.0F, 3000.0F}) {
    const auto mean = static_cast<double>(electrons);
    const Moments m = MomentsOf(Take(sensor, electrons / 100, {100, 5, 17}));
    const double variance = mean + 4 + 1.0 / 12;
    const double n = 200'000;
    EXPECT_NEAR(m.mean, 50 + mean, 5 * std::sqrt(variance / n)) << electrons;
    EXPECT_NEAR(m.variance / variance, 1, 5 * std::sqrt(2.4 / n)) << electrons;
    EXPECT_NEAR(m.skewness, mean / std::pow(variance, 1.5), 5 * std::sqrt(8 / n))
        << electrons;
    EXPECT_NEAR(m.neighbour_correlation, 0, 5 / std::sqrt(n)) << electrons;
  }
}

// Without reading noise the low counts' distribution itself.
TEST(Sensor, FewPhotonsHaveThePoissonDistribution) {
  const SensorModel sensor{.full_well_electrons = 1e6,
                           .read_noise_electrons = 0,
                           .electrons_per_count = 1,
                           .offset_counts = 0,
                           .dark_electrons_per_us = 0.02,
                           .bit_depth = 12};
  const std::vector<std::uint16_t> counts = Take(sensor, 0.01F, {100, 1, 2});
  double probability = std::exp(-3.0);  // one of light, two of dark current
  double chi2 = 0;
  for (int n = 0; n < 10; ++n) {
    const double expected = probability * static_cast<double>(counts.size());
    const auto found = static_cast<double>(std::count(counts.begin(), counts.end(), n));
    chi2 += (found - expected) * (found - expected) / expected;
    probability *= 3.0 / (n + 1);
  }
  EXPECT_LT(chi2, 29.6);  // 10 degrees of freedom, p = 0.001
}

// The photon transfer curve [EMVA1288, eq. 9] from pictures alone gives the gain back.
TEST(Sensor, PhotonTransferGivesTheGain) {
  const SensorModel sensor;
  std::vector<double> signal;
  std::vector<double> variance;
  for (const float electrons : {2000.0F, 6000.0F, 12000.0F, 20000.0F}) {
    const Moments m = MomentsOf(Take(sensor, electrons / 1000, {1000, 3, 4}));
    signal.push_back(m.mean - sensor.offset_counts);
    variance.push_back(m.variance);
  }
  const double slope = (variance[3] - variance[0]) / (signal[3] - signal[0]);
  EXPECT_NEAR(1 / slope / sensor.electrons_per_count, 1, 0.01);
  const double noise2 = variance[0] - slope * signal[0];
  const double expected = 25.0 / 36 + 1.0 / 12;
  EXPECT_NEAR(noise2, expected, 1.2);  // 0.3 % of the largest variance
}

TEST(Sensor, SaturatesAtTheWellOrTheConverter) {
  const SensorModel shallow{
      .full_well_electrons = 6000, .read_noise_electrons = 0, .electrons_per_count = 6};
  for (const std::uint16_t c : Take(shallow, 1e3F, {1000, 1, 1}, 2000)) {
    EXPECT_EQ(c, 64 + 1000);
  }
  const SensorModel deep{.full_well_electrons = 1e6};
  for (const std::uint16_t c : Take(deep, 1e3F, {1000, 1, 1}, 2000)) {
    EXPECT_EQ(c, 4095);
  }
}

TEST(Sensor, NoiseIsAFunctionOfSeedPictureAndPixel) {
  const SensorModel sensor;
  const auto one = Take(sensor, 0.5F, {1000, 9, 33}, 50'001, 1);
  EXPECT_EQ(Take(sensor, 0.5F, {1000, 9, 33}, 50'001, 4), one);
  const auto other_picture = Take(sensor, 0.5F, {1000, 9, 34}, 50'001);
  const auto other_seed = Take(sensor, 0.5F, {1000, 10, 33}, 50'001);
  EXPECT_NE(other_picture, one);
  EXPECT_NE(other_seed, one);
  // Not merely shifted: two pictures of the same are uncorrelated.
  const Moments m = MomentsOf(one);
  for (const auto& other : {other_picture, other_seed}) {
    double correlation = 0;
    for (std::size_t k = 0; k < one.size(); ++k) {
      correlation += (one[k] - m.mean) * (other[k] - m.mean) / m.variance;
    }
    EXPECT_NEAR(correlation / 50'001, 0, 5 / std::sqrt(50'001.0));
  }
}

}  // namespace
}  // namespace nacre::rigs

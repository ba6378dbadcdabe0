#include "core/error.h"
#include "core/random.h"
#include "rigs/pattern_mixture.h"
#include "rigs/phantom_noise.h"
#include "rigs/phantom_stone.h"
#include "rigs/phantom_voxels.h"
#include "tests/rigs/phantoms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace nacre::rigs {
namespace {

constexpr VoxelLayout kLayout{
    .count = {80, 60, 1}, .size_mm = {0.5, 0.5, 0.5}, .left_mm = -20, .lower_mm = -15};

TEST(Mixture, LinearFieldsAreExact) {
  const Pattern pattern = MixPlane(
      kLayout, [](double x, double y, double) { return 0.5 + 0.012 * x - 0.017 * y; });
  EXPECT_EQ(pattern.MediumCount(), 2);
  RandomStream random(3, 0);
  for (int k = 0; k < 200; ++k) {
    const PointMm a = testing::DrawPoint(random, k % 2 == 0 ? 25 : 3);
    const PointMm b = testing::DrawPoint(random, k % 2 == 0 ? 25 : 3);
    const double middle = 0.5 + 0.006 * (a.x + b.x) - 0.0085 * (a.y + b.y);
    EXPECT_NEAR(pattern.SecondMediumFraction(a, b), middle, 2e-5);
    EXPECT_NEAR(pattern.SecondMediumFraction(b, a), middle, 2e-5);
    EXPECT_EQ(pattern.MediumAt(a), 0.5 + 0.012 * a.x - 0.017 * a.y >= 0.5 ? 1 : 0);
  }
}

// Rough fields too, to what 24 samples of grouped cells can do; and ends exchanged.
TEST(Mixture, SegmentsAreTheMeansOfManySteps) {
  const VoxelFunction stone = MarbleMixture({.seed = 7, .scale_mm = 10});
  const Pattern pattern = MixPlane(kLayout, stone);
  RandomStream random(4, 0);
  double sum2 = 0;
  constexpr int kCount = 300;
  for (int k = 0; k < kCount; ++k) {
    const PointMm a = testing::DrawPoint(random, 40);
    const PointMm b = testing::DrawPoint(random, 40);
    double mean = 0;
    constexpr int kSteps = 2000;
    for (int s = 0; s < kSteps; ++s) {
      const double t = (s + 0.5) / kSteps;
      mean += pattern.mixture->At({std::lerp(a.x, b.x, t), std::lerp(a.y, b.y, t)}) /
              kSteps;
    }
    const double found = pattern.SecondMediumFraction(a, b);
    EXPECT_NEAR(found, pattern.SecondMediumFraction(b, a), 1e-4);
    EXPECT_NEAR(found, mean, 0.1);
    sum2 += (found - mean) * (found - mean);
  }
  EXPECT_LT(std::sqrt(sum2 / kCount), 0.02);
}

TEST(Mixture, TheBorderGoesOn) {
  const Pattern pattern =
      MixPlane(kLayout, [](double x, double, double) { return x < 0 ? 0.25 : 0.75; });
  EXPECT_NEAR(pattern.SecondMediumFraction({-500, 40}, {-60, 90}), 0.25, 1e-6);
  EXPECT_NEAR(pattern.SecondMediumFraction({500, -40}, {90, 2000}), 0.75, 1e-6);
  EXPECT_NEAR(pattern.SecondMediumFraction({-300, 0}, {300, 0}), 0.5, 0.02);
}

TEST(Mixture, RefusesNonsense) {
  const MixtureMap::Layout layout{.count_x = 2, .count_y = 1, .cell_mm = 1};
  EXPECT_THROW(MixtureMap(layout, {0.5F}), LogicError);
  EXPECT_THROW(MixtureMap(layout, {0.5F, 1.5F}), LogicError);
  EXPECT_THROW(MixtureMap(layout, {0.5F, NAN}), LogicError);
}

// A label is never farther off than half a level.
TEST(Mixture, LabelsAreQuantisedAsStated) {
  for (const std::size_t media : {2U, 3U, 5U}) {
    const std::vector<Blend> palette = ChainPalette(media);
    ASSERT_EQ(palette.size(), static_cast<std::size_t>(kChainLevels));
    const auto steps = static_cast<double>(media - 1);
    for (double t = 0; t <= 1; t += 1.0 / 4096) {
      const Blend& blend = palette[ChainLabel(t)];
      const double at = static_cast<double>(blend.first) + blend.second_fraction;
      EXPECT_NEAR(at, t * steps, steps / (2 * (kChainLevels - 1)) + 1e-12);
      EXPECT_EQ(blend.second, blend.first + 1);
      EXPECT_LT(blend.second, media);
    }
  }
}

TEST(Noise, IsSmoothBoundedAndSeeded) {
  const GradientNoise noise(5);
  const GradientNoise other(6);
  RandomStream random(9, 1);
  double sum = 0;
  double sum2 = 0;
  bool differs = false;
  for (int k = 0; k < 5000; ++k) {
    const double x = 300 * (random.Uniform() - 0.5);
    const double y = 300 * (random.Uniform() - 0.5);
    const double z = 300 * (random.Uniform() - 0.5);
    const double value = noise.At(x, y, z);
    EXPECT_LE(std::abs(value), 1.05);
    EXPECT_NEAR(value, noise.At(x + 1e-5, y - 1e-5, z), 1e-4);
    EXPECT_NEAR(value, noise.At(x + 256, y, z - 256), 1e-9);
    EXPECT_EQ(value, GradientNoise(noise).At(x, y, z));
    differs = differs || value != other.At(x, y, z);
    sum += value;
    sum2 += value * value;
  }
  EXPECT_TRUE(differs);
  EXPECT_NEAR(sum / 5000, 0, 0.03);
  EXPECT_GT(sum2 / 5000, 0.03);
  EXPECT_EQ(noise.At(-3, 7, 12), 0);
}

// What a stone must be: mostly ground with some veins, or all of a chain's media; the
// same for the same options.
TEST(Stone, HasVeinsAndBands) {
  const VoxelLayout plane{.count = {160, 160, 1},
                          .size_mm = {0.5, 0.5, 0.5},
                          .left_mm = -40,
                          .lower_mm = -40};
  for (int seed = 1; seed < 5; ++seed) {
    const Voxels marble =
        MixVoxels(plane, 2, MarbleMixture({.seed = seed, .scale_mm = 16}));
    const Voxels onyx = MixVoxels(plane, 3, OnyxMixture({.seed = seed}));
    double veins = 0;
    std::array<double, 3> bands{};
    for (std::size_t k = 0; k < marble.label.size(); ++k) {
      veins += marble.label[k] > kChainLevels / 2 ? 1 : 0;
      bands[std::min<std::size_t>(3U * onyx.label[k] / kChainLevels, 2)] += 1;
    }
    const auto count = static_cast<double>(marble.label.size());
    EXPECT_GT(veins / count, 0.01) << seed;
    EXPECT_LT(veins / count, 0.3) << seed;
    for (const double band : bands) {
      EXPECT_GT(band / count, 0.03) << seed;
    }
    EXPECT_EQ(MixVoxels(plane, 2, MarbleMixture({.seed = seed, .scale_mm = 16})).label,
              marble.label);
    EXPECT_NE(
        MixVoxels(plane, 2, MarbleMixture({.seed = seed + 9, .scale_mm = 16})).label,
        marble.label);
  }
}

// The same stone, turned with its direction.
TEST(Stone, VeinsRunAlongTheirDirection) {
  const VoxelFunction along_x = MarbleMixture({.direction_deg = 0});
  const VoxelFunction along_y = MarbleMixture({.direction_deg = 90});
  for (const PointMm p : {PointMm{3, 4}, {-7.7, 2.1}, {15, -9}}) {
    EXPECT_NEAR(along_x(p.x, p.y, 1), along_y(-p.y, p.x, 1), 1e-6);
  }
}

}  // namespace
}  // namespace nacre::rigs

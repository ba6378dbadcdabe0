#include "render/sampler.h"

#include "render/warp.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

namespace nacre::render {
namespace {

// A (0, 2)-sequence in base 2: of each aligned run of 2^m points, every elementary
// interval of area 2^−m has exactly one, whatever its shape [Niederreiter 87].
TEST(SamplerTest, PairsAreATwoDimensionalNet) {
  constexpr int kBits = 6;
  constexpr std::uint32_t kCount = 1u << kBits;
  for (const std::uint64_t seed : {1u, 2u, 77u}) {
    for (const std::uint32_t first : {0u, kCount, 5 * kCount}) {
      for (int split = 0; split <= kBits; ++split) {
        std::set<std::pair<int, int>> cells;
        for (std::uint32_t i = first; i < first + kCount; ++i) {
          Sampler sampler(seed, i);
          sampler.Next1D();
          const Vec2 u = sampler.Next2D();
          cells.insert({static_cast<int>(u.x * static_cast<float>(1 << split)),
                        static_cast<int>(u.y * static_cast<float>(kCount >> split))});
        }
        EXPECT_EQ(cells.size(), kCount) << "split " << split;
      }
    }
  }
}

TEST(SamplerTest, SingleDimensionsAreStratified) {
  for (const std::uint64_t seed : {3u, 9u}) {
    std::set<int> strata;
    for (std::uint32_t i = 0; i < 64; ++i) {
      Sampler sampler(seed, i);
      sampler.Next2D();
      strata.insert(static_cast<int>(sampler.Next1D() * 64));
    }
    EXPECT_EQ(strata.size(), 64u);
  }
}

TEST(SamplerTest, DimensionsAndPixelsAreUncorrelated) {
  double sum_xy = 0;
  constexpr int kPixels = 20000;
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    Sampler a(MixSeed(1, static_cast<std::uint64_t>(pixel)), 0);
    const double x = static_cast<double>(a.Next2D().x) - 0.5;
    const double y = static_cast<double>(a.Next2D().x) - 0.5;
    sum_xy += x * y;
  }
  // Uncorrelated, the mean of x y is 0 ± 1/12 / √n.
  EXPECT_NEAR(sum_xy / kPixels, 0, 4.0 / 12 / std::sqrt(double{kPixels}));
}

TEST(SamplerTest, IsAFunctionOfSeedAndIndex) {
  Sampler a(5, 3);
  Sampler b(5, 3);
  Sampler c(6, 3);
  const float value = a.Next1D();
  EXPECT_EQ(value, b.Next1D());
  EXPECT_NE(value, c.Next1D());
}

TEST(WarpTest, TrianglePointsAreUniformInArea) {
  // Mean barycentrics 1/3 and mean square 1/6 are those of the uniform density.
  double sum = 0;
  double sum2 = 0;
  constexpr std::uint32_t kCount = 1u << 16;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    Sampler sampler(1, i);
    const Vec2 b = SquareToTriangle(sampler.Next2D());
    ASSERT_GE(b.x, 0);
    ASSERT_GE(b.y, 0);
    ASSERT_LE(b.x + b.y, 1.000001F);
    sum += static_cast<double>(b.x);
    sum2 += static_cast<double>(b.x * b.x);
  }
  EXPECT_NEAR(sum / kCount, 1.0 / 3, 1e-4);
  EXPECT_NEAR(sum2 / kCount, 1.0 / 6, 1e-4);
}

TEST(WarpTest, CosineHemisphereHasTheMomentsOfItsDensity) {
  double cosine = 0;
  double cosine2 = 0;
  constexpr std::uint32_t kCount = 1u << 16;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    Sampler sampler(2, i);
    const Vec3 w = SquareToCosineHemisphere(sampler.Next2D());
    ASSERT_NEAR(Length(w), 1, 1e-5);
    cosine += static_cast<double>(w.z);
    cosine2 += static_cast<double>(w.z * w.z);
  }
  EXPECT_NEAR(cosine / kCount, 2.0 / 3, 1e-4);
  EXPECT_NEAR(cosine2 / kCount, 0.5, 1e-4);
}

}  // namespace
}  // namespace nacre::render

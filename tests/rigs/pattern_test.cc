#include "rigs/pattern.h"

#include "core/random.h"
#include "tests/rigs/phantoms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace nacre::rigs {
namespace {

const Pattern kChessboard{.type = PatternType::kChessboard, .cell_mm = 2.5};
const Pattern kStripes{.type = PatternType::kStripes, .cell_mm = 2.5};

// By asking for the medium at many places along the way.
double FractionBySteps(const Pattern& pattern, PointMm a, PointMm b) {
  constexpr int kSteps = 20000;
  int second = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double t = (k + 0.5) / kSteps;
    second += pattern.MediumAt({std::lerp(a.x, b.x, t), std::lerp(a.y, b.y, t)});
  }
  return static_cast<double>(second) / kSteps;
}

TEST(Pattern, TheCellAtTheOriginIsTheFirstMedium) {
  EXPECT_EQ(kChessboard.MediumAt({0.1, 0.1}), 0);
  EXPECT_EQ(kChessboard.MediumAt({2.4, 2.4}), 0);
  EXPECT_EQ(kChessboard.MediumAt({2.6, 0.1}), 1);
  EXPECT_EQ(kChessboard.MediumAt({-0.1, 0.1}), 1);
  EXPECT_EQ(kChessboard.MediumAt({0.1, -0.1}), 1);
  EXPECT_EQ(kChessboard.MediumAt({-0.1, -0.1}), 0);
  EXPECT_EQ(kStripes.MediumAt({0.1, -70}), 0);
  EXPECT_EQ(kStripes.MediumAt({2.6, 70}), 1);
  EXPECT_EQ(kStripes.MediumAt({-0.1, 0}), 1);
}

TEST(Pattern, EdgesBelongToTheCellAboveAndRight) {
  EXPECT_EQ(kChessboard.MediumAt({0, 0}), 0);
  EXPECT_EQ(kChessboard.MediumAt({2.5, 0}), 1);
  EXPECT_EQ(kChessboard.MediumAt({0, -2.5}), 1);
}

TEST(Pattern, FractionsAreThoseOfManySteps) {
  RandomStream random(7, 0);
  for (const Pattern& pattern : {kChessboard, kStripes}) {
    for (int k = 0; k < 300; ++k) {
      const PointMm a = testing::DrawPoint(random, 60);
      const PointMm b = testing::DrawPoint(random, k % 2 == 0 ? 60 : 8);
      EXPECT_NEAR(
          pattern.SecondMediumFraction(a, b), FractionBySteps(pattern, a, b), 1e-3)
          << a.x << ", " << a.y << " to " << b.x << ", " << b.y;
    }
  }
}

TEST(Pattern, FractionsAreTheSameBothWays) {
  RandomStream random(8, 0);
  for (int k = 0; k < 2000; ++k) {
    const PointMm a = testing::DrawPoint(random, 40);
    const PointMm b = testing::DrawPoint(random, 40);
    EXPECT_NEAR(kChessboard.SecondMediumFraction(a, b),
                kChessboard.SecondMediumFraction(b, a),
                2e-5);
  }
}

// Through corners, where a walk from cell to cell is easily lost.
TEST(Pattern, DiagonalsThroughCorners) {
  for (const double length : {1.0, 3.0, 7.5, 40.0}) {
    EXPECT_NEAR(kChessboard.SecondMediumFraction({-length, -length}, {length, length}),
                0,
                1e-5);
    EXPECT_NEAR(kChessboard.SecondMediumFraction({length, length}, {-length, -length}),
                0,
                1e-5);
    EXPECT_NEAR(kChessboard.SecondMediumFraction({-length, length}, {length, -length}),
                1,
                1e-5);
  }
}

TEST(Pattern, SegmentsAlongTheAxesAndOfNoLength) {
  EXPECT_NEAR(kChessboard.SecondMediumFraction({1, 1}, {6, 1}), 0.5, 1e-6);
  EXPECT_NEAR(kChessboard.SecondMediumFraction({1, 1}, {1, -4}), 0.5, 1e-6);
  EXPECT_NEAR(kChessboard.SecondMediumFraction({1, 6}, {1, 6}), 0, 1e-6);
  EXPECT_NEAR(kChessboard.SecondMediumFraction({1, 3}, {1, 3}), 1, 1e-6);
  EXPECT_NEAR(kStripes.SecondMediumFraction({3, 1}, {3, 90}), 1, 1e-6);
}

TEST(Pattern, AColumnIsItsPoints) {
  RandomStream random(9, 0);
  std::vector<float> x;
  std::vector<float> y;
  for (int k = 0; k < 333; ++k) {
    const PointMm p = testing::DrawPoint(random, 50);
    x.push_back(static_cast<float>(p.x));
    y.push_back(static_cast<float>(p.y));
  }
  std::vector<float> fraction(x.size());
  for (const Pattern& pattern : {Pattern{}, kChessboard, kStripes}) {
    pattern.SecondMediumFraction(
        {1.2, -3.4}, {x.data(), y.data(), x.size()}, fraction.data());
    for (std::size_t k = 0; k < x.size(); ++k) {
      const PointMm p{static_cast<double>(x[k]), static_cast<double>(y[k])};
      EXPECT_EQ(static_cast<double>(fraction[k]),
                pattern.SecondMediumFraction({1.2, -3.4}, p));
    }
  }
}

}  // namespace
}  // namespace nacre::rigs

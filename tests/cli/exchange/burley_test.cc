#include "cli/exchange/burley.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace nacre::exchange {
namespace {

// The profile's first two moments over the plane are 2.5 d and 14 d²:
// ∫ r (e^(−r) + e^(−r/3)) r dr / 4 = (2 + 54) / 4 for the second, (1 + 9) / 4 the
// first.
TEST(Burley, ShareIsTheIntegralOfTheProfile) {
  EXPECT_EQ(BurleyShare(0), 0);
  EXPECT_NEAR(BurleyShare(100), 1, 1e-12);
  double first = 0;
  double second = 0;
  constexpr double kStep = 1e-3;
  for (double r = 0; r < 80; r += kStep) {
    const double share = BurleyShare(r + kStep) - BurleyShare(r);
    first += share * (r + kStep / 2);
    second += share * (r + kStep / 2) * (r + kStep / 2);
  }
  EXPECT_NEAR(first, 2.5, 1e-4);
  EXPECT_NEAR(second, 14, 1e-3);
}

TEST(Burley, WindowHoldsWhatLiesInIt) {
  constexpr int kCore = 21;
  for (const double d : {0.1, 0.5, 3.0}) {
    const std::vector<double> window = BurleyWindow(kCore, 0.5, d);
    const double sum = std::accumulate(window.begin(), window.end(), 0.0);
    // Between the discs inside of the window and around it.
    EXPECT_GT(sum, BurleyShare(10.5 * 0.5 / d) - 2e-3) << d;
    EXPECT_LT(sum, BurleyShare(10.5 * 0.5 * std::sqrt(2) / d) + 2e-3) << d;
    EXPECT_DOUBLE_EQ(window[0], window[kCore * kCore - 1]);
    EXPECT_DOUBLE_EQ(window[5], window[5 * kCore]);
  }
}

// [Christensen15, fig. 2]: the length is longest for the darkest surfaces, and s(0.8)
// is the least but one. [Chiang16]: no absorption for a white surface, nothing for a
// black.
TEST(Burley, ScalingAndAlbedoInversion) {
  EXPECT_NEAR(BurleyScaling(0.8), 1.1, 1e-12);
  EXPECT_NEAR(BurleyScaling(0), 4.14, 1e-12);
  EXPECT_EQ(SingleScatteringAlbedo(0), 0);
  EXPECT_NEAR(
      SingleScatteringAlbedo(1), 1 - std::exp(-5.09406 + 2.61188 - 4.31805), 1e-12);
  double before = 0;
  for (double a = 0.05; a <= 1; a += 0.05) {
    EXPECT_GT(SingleScatteringAlbedo(a), before);
    before = SingleScatteringAlbedo(a);
  }
}

}  // namespace
}  // namespace nacre::exchange

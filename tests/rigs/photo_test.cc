#include "rigs/photo.h"

#include "core/error.h"
#include "core/fresnel.h"
#include "tests/rigs/phantoms.h"
#include "tests/support/thread_ranks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::rigs {
namespace {

using ::testing::HasSubstr;

ExrPart Image(int width, int height, float value) {
  ExrPart image;
  image.width = width;
  image.height = height;
  image.channels = {"Y"};
  image.values.assign(image.PixelCount(), value);
  return image;
}

Phantom TestPhantom() {
  Phantom phantom = testing::Homogeneous(0.1, 3, 10);
  phantom.grid = {.points_x = 24, .points_y = 16, .pitch_mm = 2, .core = 5};
  return phantom;
}

// Far from the edges of an even irradiance, what leaves is what entered times R.
TEST(Photo, OfEvenLightIsEven) {
  const Phantom phantom = TestPhantom();
  const ExrPart photo = PhotographUnder(phantom, Solver::kAuto, Image(48, 32, 3));
  const double reflected =
      MakeTransport(phantom, Solver::kAuto)->TotalsAt({}, 0).reflected;
  const double middle = static_cast<double>(photo.values[16 * 48 + 24]);
  EXPECT_NEAR(middle / (3 * FresnelTransmittance(1, 1.5) * reflected), 1, 2e-3);
  EXPECT_LT(photo.values[0], 0.8F * photo.values[16 * 48 + 24]);  // dark beyond
}

TEST(Photo, IsLinearAndPutsLightWhereItFell) {
  const Phantom phantom = TestPhantom();
  ExrPart spot = Image(24, 16, 0);
  spot.values[3 * 24 + 20] = 1;  // row 3, column 20
  const ExrPart one = PhotographUnder(phantom, Solver::kFast, spot, 1);
  const auto brightest = std::max_element(one.values.begin(), one.values.end());
  EXPECT_EQ(brightest - one.values.begin(), 3 * 24 + 20);
  ExrPart more = spot;
  more.values[9 * 24 + 7] = 2;
  ExrPart rest = Image(24, 16, 0);
  rest.values[9 * 24 + 7] = 2;
  const ExrPart both = PhotographUnder(phantom, Solver::kFast, more, 3);
  const ExrPart other = PhotographUnder(phantom, Solver::kFast, rest, 2);
  for (std::size_t k = 0; k < both.values.size(); ++k) {
    EXPECT_NEAR(both.values[k], one.values[k] + other.values[k], 1e-6);
  }
}

TEST(Photo, RanksShareItAndGiveTheSameBits) {
  ExrPart stripe = Image(24, 16, 0);
  for (std::size_t k = 0; k < stripe.values.size(); k += 5) {
    stripe.values[k] = 1 + static_cast<float>(k);
  }
  for (const Solver solver : {Solver::kFast, Solver::kMonteCarlo}) {
    SolverOptions options{.photons = 5000, .thread_count = 1};
    const Photo alone = PhotographUnder(TestPhantom(), solver, stripe, options);
    nacre::testing::OnThreadRanks(3, [&](const Ranks& ranks) {
      SolverOptions shared = options;
      shared.ranks = &ranks;
      const Photo photo = PhotographUnder(TestPhantom(), solver, stripe, shared);
      if (ranks.IsRoot()) {
        EXPECT_EQ(photo.exitance.values, alone.exitance.values) << Name(solver);
        EXPECT_EQ(photo.standard_error.values, alone.standard_error.values);
      }
    });
  }
}

TEST(Photo, RefusesPicturesThatDoNotFit) {
  EXPECT_THAT([] { PhotographUnder(TestPhantom(), Solver::kFast, Image(30, 30, 1)); },
              ::testing::ThrowsMessage<Error>(HasSubstr("aren't square")));
  ExrPart red = Image(24, 16, 1);
  red.channels = {"R"};
  EXPECT_THAT([&] { PhotographUnder(TestPhantom(), Solver::kFast, red); },
              ::testing::ThrowsMessage<Error>(HasSubstr("no channel Y")));
  Phantom no_grid = TestPhantom();
  no_grid.grid = {};
  EXPECT_THAT([&] { PhotographUnder(no_grid, Solver::kFast, Image(24, 16, 1)); },
              ::testing::ThrowsMessage<Error>(HasSubstr("no [grid]")));
}

}  // namespace
}  // namespace nacre::rigs

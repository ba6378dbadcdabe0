#include "core/error.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "tests/rigs/transport/monte_carlo/support.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace nacre::rigs::monte_carlo {
namespace {

Phantom TwoChannels() {
  Phantom phantom;
  phantom.channels = {"R", "B"};
  phantom.slab = {.thickness_mm = 5, .eta = 1.5, .bottom = Bottom::kBlack};
  phantom.media = {{"A", {0.1, 0.2}, {2, 3}, {0, 0.3}},
                   {"B", {0.3, 0.4}, {1, 1}, {0, 0}}};
  phantom.pattern = {PatternType::kChessboard, 1.5};
  phantom.grid.points_x = 4;
  phantom.grid.points_y = 4;
  phantom.grid.pitch_mm = 0.25;
  phantom.grid.core = 7;
  return phantom;
}

TEST(MonteCarloTransport, WindowsHaveErrorsAndRepeat) {
  const MonteCarloTransport transport(TwoChannels(), Photons(50'000));
  const Window here = transport.WindowAround({0.125, 0.375});
  ASSERT_EQ(here.rd.size(), 98U);
  ASSERT_EQ(here.sigma.size(), 98U);
  for (std::size_t k = 0; k < here.rd.size(); ++k) {
    EXPECT_GT(here.sigma[k], 0);
  }
  EXPECT_EQ(here.rd, transport.WindowAround({0.125, 0.375}).rd);
  EXPECT_NE(here.rd, transport.WindowAround({0.125, 0.125}).rd);
  EXPECT_GT(here.rd[24], here.rd[23]);  // brightest at the beam
  EXPECT_NE(here.rd[24], here.rd[49 + 24]);
}

TEST(MonteCarloTransport, ExitanceIsTheWindowsCells) {
  const MonteCarloTransport transport(TwoChannels(), Photons(50'000));
  const PointMm x_i{0.4, 0.1};
  // Middle, right neighbour, upper neighbour; the farthest sets the window's size.
  const std::array<float, 4> x{0.4F, 0.65F, 0.4F, 1.15F};
  const std::array<float, 4> y{0.1F, 0.1F, 0.35F, -0.65F};
  std::array<float, 4> exitance{1, 0, 0, 0};
  transport.AddExitance(x_i, 1, 2, {x.data(), y.data(), 4}, exitance.data());
  const Window window = transport.WindowAround(x_i);
  EXPECT_FLOAT_EQ(exitance[0], 1 + 2 * window.rd[49 + 24]);
  EXPECT_FLOAT_EQ(exitance[1], 2 * window.rd[49 + 25]);
  EXPECT_FLOAT_EQ(exitance[2], 2 * window.rd[49 + 17]);
  EXPECT_FLOAT_EQ(exitance[3], 2 * window.rd[49 + 48]);
}

TEST(MonteCarloTransport, ExitanceNeedsAGrid) {
  Phantom phantom = TwoChannels();
  phantom.grid = {};
  const MonteCarloTransport transport(phantom, Photons(1'000));
  float exitance = 0;
  const float zero = 0;
  EXPECT_THROW(transport.AddExitance({0, 0}, 0, 1, {&zero, &zero, 1}, &exitance),
               Error);
}

TEST(MonteCarloTransport, TotalsAddUp) {
  const MonteCarloTransport transport(TwoChannels(), Photons(50'000));
  const Totals totals = transport.TotalsAt({0.75, 0.75}, 0);
  EXPECT_NEAR(totals.reflected + totals.transmitted + totals.absorbed, 1, 1e-12);
  EXPECT_EQ(totals.transmitted, 0);  // a black backing
  EXPECT_GT(totals.reflected, 0.1);
}

TEST(MonteCarloTransport, LittleLeavesBeyondReach) {
  const MonteCarloTransport transport(TwoChannels(), Photons(400'000, 3));
  const double reach_mm = transport.ReachMm(0);
  const TallyRequest request{
      .window_centre = {0.75, 0.75}, .ring_count = 1, .ring_width_mm = reach_mm};
  const Result r = transport.Simulate({0.75, 0.75}, 0, request);
  const double within = r.ring_per_mm2[0].mean * 3.14159265358979 * reach_mm * reach_mm;
  EXPECT_LT(r.reflected.mean - within, 1.5e-4);
  EXPECT_GT(r.reflected.mean - within, 2e-5);  // nor is it far too large
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

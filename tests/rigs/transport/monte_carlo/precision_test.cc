// As many photons as an error needs, in as many batches; light of whole pictures;
// beams far from the origin.
#include "core/error.h"
#include "rigs/photo.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "tests/rigs/phantoms.h"
#include "tests/rigs/transport/monte_carlo/support.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Phantom Board() {
  Phantom phantom = testing::TwoMarbles(PatternType::kChessboard, 1.5);
  phantom.grid = {.points_x = 9, .points_y = 7, .pitch_mm = 0.5, .core = 9};
  return phantom;
}

TEST(Precision, PhotonsMayComeInBatches) {
  const TallyRequest request{.window_core = 5, .window_pitch_mm = 0.5};
  const Result once = Simulate(Chessboard(), {}, request, Photons(70'001));
  Simulation simulation(Chessboard(), {}, request, Photons(1));
  for (const std::int64_t photons : {1, 4'000, 66'000}) {
    simulation.Add(photons);
  }
  const Result batches = simulation.Get();
  EXPECT_EQ(batches.photon_count, 70'001);
  EXPECT_EQ(batches.reflected.mean, once.reflected.mean);
  EXPECT_EQ(batches.step_count, once.step_count);
  for (std::size_t k = 0; k < once.window_per_mm2.size(); ++k) {
    EXPECT_EQ(batches.window_per_mm2[k].mean, once.window_per_mm2[k].mean);
  }
}

TEST(Precision, TotalsAreKnownToTheWantedError) {
  const MonteCarloTransport transport(
      Board(), Photons(100'000'000), {.wanted_error = 5e-3});
  const Totals totals = transport.TotalsAt({0.75, 0.75}, 0);
  EXPECT_LE(RelativeError(totals), 5e-3);
  EXPECT_GT(RelativeError(totals), 4e-3) << "more photons than needed";
  Options one_thread = Photons(100'000'000);
  one_thread.thread_count = 1;
  const MonteCarloTransport other(Board(), one_thread, {.wanted_error = 5e-3});
  EXPECT_EQ(other.TotalsAt({0.75, 0.75}, 0).reflected, totals.reflected);
}

TEST(Precision, WindowsAreKnownToTheWantedErrorOrAsFarAsPhotonsGo) {
  const TallyRequest request{
      .window_core = 9, .window_pitch_mm = 0.5, .use_symmetry = true};
  const MonteCarloTransport transport(
      Board(), Photons(100'000'000), {.wanted_error = 0.01});
  const double error = RelativeError(transport.Simulate({0, 0}, 0, request));
  EXPECT_LE(error, 0.01);
  EXPECT_GT(error, 0.007);
  const MonteCarloTransport few(Board(), Photons(100'000), {.wanted_error = 0.001});
  const Result result = few.Simulate({0, 0}, 0, request);
  EXPECT_EQ(result.photon_count, 100'000);
  EXPECT_GT(RelativeError(result), 0.001);
}

// The error is what it says: mean over runs, against one with far more photons.
TEST(Precision, TheErrorOfAWindowIsWhatIsExpected) {
  const TallyRequest request{.window_core = 9, .window_pitch_mm = 0.5};
  const Result fine = Simulate(Chessboard(), {}, request, Photons(1'000'000, 99));
  constexpr int kRuns = 20;
  double ratio = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Result rough = Simulate(Chessboard(), {}, request, Photons(10'000, run));
    double error = 0;
    double sum = 0;
    for (std::size_t k = 0; k < fine.window_per_mm2.size(); ++k) {
      error += std::abs(rough.window_per_mm2[k].mean - fine.window_per_mm2[k].mean);
      sum += fine.window_per_mm2[k].mean;
    }
    ratio += error / sum / RelativeError(rough) / kRuns;
  }
  EXPECT_NEAR(ratio, 1, 0.1);
}

// Half of a pencil on a border enters each medium, wherever rounding puts it.
TEST(Precision, PencilsOnBordersEnterBothMedia) {
  const MonteCarloTransport transport(Board(), Photons(200'000));
  const Totals left = transport.TotalsAt({0, 0.75}, 0);
  const Totals right = transport.TotalsAt({1.5, 0.75}, 0);
  const Totals marble = transport.TotalsAt({0.02, 0.75}, 0);
  const Totals dark = transport.TotalsAt({1.52, 0.75}, 0);
  const double se = std::hypot(left.reflected_se, right.reflected_se);
  EXPECT_NEAR(left.reflected, right.reflected, 4 * se);
  EXPECT_NEAR(left.reflected, 0.5 * (marble.reflected + dark.reflected), 6 * se);
  EXPECT_GT(marble.reflected - dark.reflected, 20 * se);
}

TEST(Precision, BeamsFarOutAreAsBeamsNear) {
  const MonteCarloTransport transport(Board(), Photons(20'000));
  const Window near = transport.WindowAround({0.375, 0.5});
  EXPECT_EQ(transport.WindowAround({3e6 + 0.375, -6e6 + 0.5}).rd, near.rd);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_THAT(
      [&] {
        transport.WindowAround({infinity, 0});
      },
      ThrowsMessage<Error>(HasSubstr("positions must be finite")));
  EXPECT_THAT(
      [] {
        Simulate(Chessboard(), {.centre = {1e9, 0}}, {}, Photons(1));
      },
      ThrowsMessage<Error>(HasSubstr("of the origin")));
}

// Light that enters uniformly over a board's repeating part, pixel by pixel, comes out
// as the sum of its pixels' windows does.
TEST(Precision, APictureIsTheSumOfItsPixels) {
  const Phantom phantom = Board();
  ExrPart light;
  light.width = 9;
  light.height = 7;
  light.channels = phantom.channels;
  light.values.assign(63, 0.0F);
  const std::array<int, 2> lit{12, 40};
  light.values[12] = 2;
  light.values[40] = 0.5F;
  const Photo photo = PhotographUnder(
      phantom, Solver::kMonteCarlo, light, SolverOptions{.photons = 400'000});
  Phantom wide = phantom;
  wide.grid.core = 19;
  const MonteCarloTransport transport(wide, Photons(400'000, 9));
  std::vector<double> sum(63);
  std::vector<double> variance(63);
  for (const int k : lit) {
    const Window window = transport.WindowAround(phantom.grid.Point(k % 9, k / 9));
    const double entered =
        0.96 * 0.25 * static_cast<double>(light.values[static_cast<std::size_t>(k)]);
    for (int to = 0; to < 63; ++to) {
      const int u = to % 9 - k % 9 + 9;
      const int v = to / 9 - k / 9 + 9;
      const auto cell = static_cast<std::size_t>(v * 19 + u);
      const auto at = static_cast<std::size_t>(to);
      sum[at] += entered * static_cast<double>(window.rd[cell]);
      variance[at] += std::pow(entered * static_cast<double>(window.sigma[cell]), 2);
    }
  }
  double chi2 = 0;
  for (std::size_t k = 0; k < 63; ++k) {
    const double se = static_cast<double>(photo.standard_error.values[k]);
    const double z = (static_cast<double>(photo.exitance.values[k]) - sum[k]) /
                     std::sqrt(variance[k] + se * se);
    EXPECT_LT(std::abs(z), 4.5) << k;
    chi2 += z * z;
  }
  EXPECT_NEAR(chi2 / 63, 1, 0.6);
}

TEST(Precision, LightMustBeLight) {
  const std::array<PointMm, 2> places{{{0, 0}, {1, 0}}};
  EXPECT_THAT(
      [&] {
        MakeFootprint(places, std::array<double, 2>{1, -1});
      },
      ThrowsMessage<Error>(HasSubstr("light can't be negative")));
  EXPECT_THAT(
      [&] {
        MakeFootprint(places, std::array<double, 2>{0, 0});
      },
      ThrowsMessage<Error>(HasSubstr("there must be light")));
  ExrPart light;
  light.width = 9;
  light.height = 7;
  light.channels = {"Y"};
  light.values.assign(63, std::numeric_limits<float>::quiet_NaN());
  EXPECT_THAT([&] { PhotographUnder(Board(), Solver::kMonteCarlo, light, 1); },
              ThrowsMessage<Error>(HasSubstr("a pixel of nan")));
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

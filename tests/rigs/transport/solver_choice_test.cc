#include "rigs/transport/solver_choice.h"

#include "core/error.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "tests/rigs/phantoms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace nacre::rigs {
namespace {

using ::testing::HasSubstr;
using testing::Homogeneous;

// Marble and a dark partner, of the kinds that were measured.
Phantom Board(double cell_mm, double pitch_mm) {
  Phantom phantom = testing::TwoMarbles(PatternType::kChessboard, cell_mm);
  phantom.media[1].sigma_a_per_mm = {0.05};
  phantom.grid.pitch_mm = pitch_mm;
  return phantom;
}

TEST(Solvers, AreFoundByTheirNames) {
  for (const Solver solver :
       {Solver::kAuto, Solver::kFast, Solver::kDiffusion, Solver::kMonteCarlo}) {
    EXPECT_EQ(ParseSolver(Name(solver)), solver);
  }
  EXPECT_THAT([] { ParseSolver("photon soup"); },
              ::testing::ThrowsMessage<Error>(
                  HasSubstr("there are: auto, fast, diffusion, mc")));
}

TEST(Solvers, RefuseOptionsOutOfRange) {
  const Phantom phantom = Homogeneous(0.05, 1, 10);
  EXPECT_THAT(
      [&] {
        MakeTransport(phantom,
                      Solver::kMonteCarlo,
                      {.error = std::numeric_limits<double>::quiet_NaN()});
      },
      ::testing::ThrowsMessage<Error>(HasSubstr("option error is nan")));
  EXPECT_THAT([&] { MakeTransport(phantom, Solver::kFast, {.diffuse = true}); },
              ::testing::ThrowsMessage<Error>(HasSubstr("can't do diffuse light")));
}

Solver Chosen(const Phantom& phantom,
              double error,
              Quantity quantity = Quantity::kWindow) {
  const Selection selection = SelectSolver(phantom, {.error = error}, quantity);
  EXPECT_THAT(selection.why, HasSubstr(Name(selection.solver)));
  EXPECT_LE(selection.stated_error, error > 0 ? error : 1);
  return selection.solver;
}

TEST(SolverChoice, IsTheCheapestThatMeetsTheError) {
  Phantom phantom = Homogeneous(0.005, 1, 20);
  EXPECT_EQ(Chosen(phantom, 0), Solver::kFast);
  EXPECT_EQ(Chosen(phantom, 0.5), Solver::kFast);
  EXPECT_EQ(Chosen(phantom, 0.02), Solver::kDiffusion);
  EXPECT_EQ(Chosen(phantom, 0.001), Solver::kMonteCarlo);
  EXPECT_EQ(Chosen(phantom, 0.05, Quantity::kTotals), Solver::kFast);
}

TEST(SolverChoice, NothingIsStatedBeyondWhatWasMeasured) {
  Phantom phantom = Board(1.5, 2);
  const auto stated = [&](Solver solver) {
    return StatedError(phantom, solver, Quantity::kWindow);
  };
  EXPECT_LT(stated(Solver::kDiffusion), stated(Solver::kFast));
  EXPECT_LT(stated(Solver::kFast), 0.5);
  phantom.slab.bottom = Bottom::kWhite;
  EXPECT_TRUE(std::isinf(stated(Solver::kFast)));
  phantom.slab.bottom = Bottom::kAir;
  phantom.media[1].sigma_a_per_mm = {5};
  EXPECT_TRUE(std::isinf(stated(Solver::kDiffusion)));
  EXPECT_EQ(stated(Solver::kMonteCarlo), 0);
}

TEST(SolverChoice, SaysWhoCantDoThePhantom) {
  Phantom oblique = Homogeneous(0.01, 1, 20);
  oblique.beam.angle_rad = 0.5;
  const Selection selection = SelectSolver(oblique, {}, Quantity::kWindow);
  EXPECT_EQ(selection.solver, Solver::kMonteCarlo);
  EXPECT_THAT(selection.why, HasSubstr("beam.angle_deg"));
}

double WindowError(const Window& window, const Window& truth) {
  double error = 0;
  double sum = 0;
  for (std::size_t k = 0; k < window.rd.size(); ++k) {
    error += std::abs(static_cast<double>(window.rd[k] - truth.rd[k]));
    sum += static_cast<double>(truth.rd[k]);
  }
  return error / sum;
}

// The statements themselves, against Monte Carlo known to 0.5 %.
TEST(SolverChoice, StatedErrorsHold) {
  Phantom slab = Homogeneous(0.01, 1, 20);
  slab.grid.pitch_mm = 1;
  const Phantom board = Board(2, 0.7);
  constexpr double kNoise = 0.005;
  for (const Phantom& phantom : {slab, board}) {
    const PointMm x_i{0.9, 1.1};
    const auto truth = MakeTransport(phantom, Solver::kMonteCarlo, {.error = kNoise})
                           ->WindowAround(x_i);
    for (const Solver solver : {Solver::kFast, Solver::kDiffusion}) {
      const double stated = StatedError(phantom, solver, Quantity::kWindow);
      const double error =
          WindowError(MakeTransport(phantom, solver)->WindowAround(x_i), truth);
      EXPECT_LT(error, stated + kNoise) << Name(solver);
      EXPECT_GT(error, stated / 10) << Name(solver) << ": far better than stated";
    }
  }
}

}  // namespace
}  // namespace nacre::rigs

#include "rigs/transport/solve_grid.h"

#include "core/error.h"
#include "tests/rigs/phantoms.h"
#include "tests/support/thread_ranks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

namespace nacre::rigs {
namespace {

using testing::TwoMarbles;

Phantom Board() {
  Phantom phantom = TwoMarbles(PatternType::kChessboard, 1.5);
  phantom.grid = {.points_x = 13, .points_y = 11, .pitch_mm = 0.25, .core = 7};
  return phantom;
}

struct Solved {
  std::vector<Window> windows;
  GridSummary summary;
};

Solved Solve(const Transport& transport) {
  const acquire::GridDescription& grid = transport.phantom().grid;
  Solved solved;
  solved.windows.resize(static_cast<std::size_t>(grid.points_x * grid.points_y));
  solved.summary = SolveGrid(transport, [&](int i, int j, Window&& window) {
    Window& at = solved.windows[static_cast<std::size_t>(j * grid.points_x + i)];
    EXPECT_TRUE(at.rd.empty()) << "twice";
    at = std::move(window);
  });
  return solved;
}

TEST(SolveGrid, RepeatedPointsAreSolvedOnceAndRight) {
  const Phantom phantom = Board();
  const auto transport = MakeTransport(phantom, Solver::kFast);
  const Solved solved = Solve(*transport);
  EXPECT_EQ(solved.summary.points, 143);
  EXPECT_LT(solved.summary.distinct, 40);
  for (std::size_t k = 0; k < solved.windows.size(); ++k) {
    const Window direct = transport->WindowAround(
        phantom.grid.Point(static_cast<int>(k % 13), static_cast<int>(k / 13)));
    ASSERT_EQ(solved.windows[k].rd.size(), direct.rd.size());
    for (std::size_t c = 0; c < direct.rd.size(); ++c) {
      EXPECT_NEAR(solved.windows[k].rd[c], direct.rd[c], 2e-3F * direct.rd[c]);
    }
  }
}

// The root gets all windows, with the bits that one process makes; others get none.
TEST(SolveGrid, RanksShareItsWorkAndGiveTheSameBits) {
  Phantom phantom = Board();
  phantom.grid.points_x = 7;
  for (const Solver solver : {Solver::kFast, Solver::kDiffusion, Solver::kMonteCarlo}) {
    SolverOptions options{.photons = 2000, .near_field = false, .thread_count = 1};
    const Solved alone = Solve(*MakeTransport(phantom, solver, options));
    for (const int size : {2, 3}) {
      nacre::testing::OnThreadRanks(size, [&](const Ranks& ranks) {
        SolverOptions shared = options;
        shared.ranks = &ranks;
        const Solved solved = Solve(*MakeTransport(phantom, solver, shared));
        for (std::size_t k = 0; k < solved.windows.size(); ++k) {
          if (!ranks.IsRoot()) {
            ASSERT_TRUE(solved.windows[k].rd.empty()) << Name(solver);
            continue;
          }
          ASSERT_EQ(solved.windows[k].rd, alone.windows[k].rd) << Name(solver);
          ASSERT_EQ(solved.windows[k].sigma, alone.windows[k].sigma) << Name(solver);
        }
        EXPECT_GT(ranks.traffic().messages_sent + ranks.traffic().messages_received, 0);
      });
    }
  }
}

// Chi-squared a cell between windows of the grid and windows simulated on their own.
double Misfit(const Phantom& phantom, const Solved& solved) {
  const auto other =
      MakeTransport(phantom, Solver::kMonteCarlo, {.photons = 60'000, .seed = 77});
  double chi2 = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < solved.windows.size(); k += 9) {
    const Window direct = other->WindowAround(
        phantom.grid.Point(static_cast<int>(k % 13), static_cast<int>(k / 13)));
    for (std::size_t c = 0; c < direct.rd.size(); ++c) {
      const float z = (solved.windows[k].rd[c] - direct.rd[c]) /
                      std::hypot(solved.windows[k].sigma[c], direct.sigma[c]);
      chi2 += static_cast<double>(z * z);
      ++count;
    }
  }
  return chi2 / static_cast<double>(count);
}

TEST(SolveGrid, ObliqueBeamsShareShiftedPointsOnly) {
  Phantom phantom = Board();
  const SolverOptions options{.photons = 60'000};
  const Solved straight = Solve(*MakeTransport(phantom, Solver::kMonteCarlo, options));
  EXPECT_NEAR(Misfit(phantom, straight), 1, 0.2);
  phantom.beam.angle_rad = 0.9;
  const Solved oblique = Solve(*MakeTransport(phantom, Solver::kMonteCarlo, options));
  EXPECT_NEAR(Misfit(phantom, oblique), 1, 0.2);
  EXPECT_GT(oblique.summary.distinct, 2 * straight.summary.distinct);
  EXPECT_LT(oblique.summary.distinct, 143);
}

TEST(SolveGrid, CanBeStopped) {
  const auto stop = [](const Progress&) { return false; };
  for (const Solver solver : {Solver::kFast, Solver::kMonteCarlo}) {
    const auto transport = MakeTransport(Board(), solver, {.photons = 100'000});
    EXPECT_THROW(SolveGrid(
                     *transport, [](int, int, Window&&) {}, stop),
                 Error);
  }
}

}  // namespace
}  // namespace nacre::rigs

#include "rigs/transport/diffusion/distinct_points.h"

#include "rigs/transport/diffusion/diffusion_transport.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>

namespace nacre::rigs::diffusion {
namespace {

acquire::GridDescription Grid(int points, double pitch_mm, int core) {
  acquire::GridDescription grid;
  grid.points_x = points;
  grid.points_y = points;
  grid.pitch_mm = pitch_mm;
  grid.core = core;
  return grid;
}

TEST(DistinctPoints, HomogeneousNeedsOne) {
  const auto distinct = FindDistinctPoints({}, Grid(9, 0.5, 3));
  EXPECT_EQ(distinct.points.size(), 1U);
  EXPECT_EQ(distinct.of.size(), 81U);
}

// Six points a cell, none on a border: 3 distances along each axis, ordered pairs of
// them, and two media.
TEST(DistinctPoints, AlignedChessboardNeedsAnEighthOfTwoCells) {
  const Pattern pattern{PatternType::kChessboard, 3};
  const auto distinct = FindDistinctPoints(pattern, Grid(24, 0.5, 3));
  EXPECT_EQ(distinct.points.size(), 2U * 6U);
}

// 277 points, 4 cells of 69.25 pitches: only the half turn, the transposition and their
// product map the grid on itself; points on the axes of those are their own images.
TEST(DistinctPoints, UnalignedChessboardNeedsAQuarter) {
  const Pattern pattern{PatternType::kChessboard, 31.5};
  const auto distinct = FindDistinctPoints(pattern, Grid(277, 126.0 / 277, 3));
  EXPECT_EQ(distinct.points.size(), (277U * 277U + 2U * 277U + 1U) / 4U);
}

TEST(DistinctPoints, StripesRepeatAlongY) {
  const Pattern pattern{PatternType::kStripes, 3};
  const auto distinct = FindDistinctPoints(pattern, Grid(24, 0.5, 3));
  EXPECT_EQ(distinct.points.size(), 6U);
}

// Any x_i, transformed from its representative, against the medium at every cell of its
// window: the symmetry must carry the pattern itself.
void ExpectSymmetriesCarryThePattern(const Pattern& pattern,
                                     const acquire::GridDescription& grid) {
  const auto distinct = FindDistinctPoints(pattern, grid);
  const auto picture = [&](PointMm x_i) {
    Window window;
    const int half = (grid.core - 1) / 2;
    for (int row = -half; row <= half; ++row) {
      for (int col = -half; col <= half; ++col) {
        // Off the lattice, to keep away from borders.
        const int medium = pattern.MediumAt(
            {x_i.x + 0.977 * col * grid.pitch_mm, x_i.y - 0.977 * row * grid.pitch_mm});
        // The beam itself may sit on a border.
        window.rd.push_back(row == 0 || col == 0 ? 0.0F : static_cast<float>(medium));
        window.sigma.push_back(0);
      }
    }
    return window;
  };
  std::size_t k = 0;
  for (int j = 0; j < grid.points_y; ++j) {
    for (int i = 0; i < grid.points_x; ++i, ++k) {
      const Window expected = picture(grid.Point(i, j));
      const Window found = Transformed(
          picture(distinct.points[distinct.of[k]]), grid.core, distinct.symmetry[k]);
      ASSERT_EQ(found.rd, expected.rd) << i << ' ' << j;
    }
  }
}

TEST(DistinctPoints, SymmetriesCarryThePattern) {
  const Pattern chess{PatternType::kChessboard, 3};
  ExpectSymmetriesCarryThePattern(chess, Grid(24, 0.5, 9));
  ExpectSymmetriesCarryThePattern(chess, Grid(23, 0.5, 9));   // points on borders
  ExpectSymmetriesCarryThePattern(chess, Grid(20, 0.43, 9));  // no alignment
  ExpectSymmetriesCarryThePattern({PatternType::kStripes, 3}, Grid(23, 0.5, 9));
}

// The whole point: the mapped window is the one a solve at the point itself gives, to
// what tiles of different position change (truncation and mesh).
TEST(DistinctPoints, MappedWindowIsTheDirectOne) {
  const Phantom phantom = ParsePhantom(
      "[slab]\nthickness_mm = 6\neta = 1.4\n"
      "[[medium]]\nsigma_a_per_mm = 0.005\nsigma_s_per_mm = 2.0\n"
      "[[medium]]\nsigma_a_per_mm = 0.05\nsigma_s_per_mm = 1.0\n"
      "[pattern]\ntype = \"chessboard\"\ncell_mm = 3\n"
      "[grid]\npoints = [24, 24]\npitch_mm = 0.5\ncore = 13\n",
      "test");
  const DiffusionTransport transport(phantom, {.reference_photons = 0});
  const auto distinct = FindDistinctPoints(phantom.pattern, phantom.grid);
  for (const std::size_t k : {517U, 300U, 130U}) {
    const PointMm x_i =
        phantom.grid.Point(static_cast<int>(k % 24), static_cast<int>(k / 24));
    const Window direct = transport.WindowAround(x_i);
    const Window mapped =
        Transformed(transport.WindowAround(distinct.points[distinct.of[k]]),
                    13,
                    distinct.symmetry[k]);
    for (std::size_t cell = 0; cell < direct.rd.size(); ++cell) {
      EXPECT_NEAR(
          static_cast<double>(mapped.rd[cell]) / static_cast<double>(direct.rd[cell]),
          1,
          2e-3)
          << k << ' ' << cell;
    }
  }
}

}  // namespace
}  // namespace nacre::rigs::diffusion

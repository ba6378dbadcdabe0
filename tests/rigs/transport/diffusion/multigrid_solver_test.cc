#include "rigs/transport/diffusion/multigrid_solver.h"

#include "core/error.h"
#include "core/random.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>

namespace nacre::rigs::diffusion {
namespace {

using std::numbers::pi;
using Function3 = std::function<double(double, double, double)>;

Mesh UnitCube(int n) {
  return {UniformAxis(0, 1, n), UniformAxis(0, 1, n), UniformAxis(0, 1, n)};
}

double VariableD(double x, double y) {
  return 1 + 0.6 * std::cos(pi * x) * std::cos(pi * y);
}

LateralField VariableField(const Mesh& mesh, double sigma_a) {
  LateralField field;
  for (int j = 0; j < mesh.y.Count(); ++j) {
    for (int i = 0; i < mesh.x.Count(); ++i) {
      field.sigma_a_per_mm.push_back(sigma_a);
      field.diffusion_mm.push_back(VariableD(mesh.x.Centre(i), mesh.y.Centre(j)));
      field.east_diffusion_mm.push_back(VariableD(mesh.x.High(i), mesh.y.Centre(j)));
      field.north_diffusion_mm.push_back(VariableD(mesh.x.Centre(i), mesh.y.High(j)));
      field.side_decay_per_mm.push_back(0);
    }
  }
  return field;
}

// φ = cos(πx) cos(2πy) sin(πz): no flux through the sides, 0 on top and bottom.
double Phi(double x, double y, double z) {
  return std::cos(pi * x) * std::cos(2 * pi * y) * std::sin(pi * z);
}

// −∇·(D∇φ) + σφ for that φ and VariableD, by hand.
double Source(double x, double y, double z, double sigma_a) {
  const double d = VariableD(x, y);
  const double dx = -0.6 * pi * std::sin(pi * x) * std::cos(pi * y);
  const double dy = -0.6 * pi * std::cos(pi * x) * std::sin(pi * y);
  const double px = -pi * std::sin(pi * x) * std::cos(2 * pi * y) * std::sin(pi * z);
  const double py =
      -2 * pi * std::cos(pi * x) * std::sin(2 * pi * y) * std::sin(pi * z);
  return d * 6 * pi * pi * Phi(x, y, z) - dx * px - dy * py + sigma_a * Phi(x, y, z);
}

double WorstError(int n) {
  const Mesh mesh = UnitCube(n);
  const SlabOperator op = Assemble(mesh, VariableField(mesh, 2), {0, 0});
  MultigridSolver<double> solver(op);
  const double volume = 1.0 / (n * n * n);
  const auto nz = static_cast<std::size_t>(n);
  std::size_t c = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i, ++c) {
      for (int k = 0; k < n; ++k) {
        solver.rhs()[c * nz + static_cast<std::size_t>(k)].v[2] =
            volume * Source(mesh.x.Centre(i), mesh.y.Centre(j), mesh.z.Centre(k), 2);
      }
    }
  }
  solver.Solve(1e-10);
  double worst = 0;
  c = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i, ++c) {
      for (int k = 0; k < n; ++k) {
        const double value =
            solver.solution()[c * nz + static_cast<std::size_t>(k)].v[2];
        worst = std::max(
            worst,
            std::abs(value -
                     Phi(mesh.x.Centre(i), mesh.y.Centre(j), mesh.z.Centre(k))));
      }
    }
  }
  return worst;
}

TEST(MultigridSolver, ManufacturedSolutionConvergesWithSecondOrder) {
  const double coarse = WorstError(8);
  const double middle = WorstError(16);
  const double fine = WorstError(32);
  EXPECT_LT(fine, 3e-3);
  EXPECT_GT(std::log2(coarse / middle), 1.8) << coarse << ' ' << middle;
  EXPECT_GT(std::log2(middle / fine), 1.9) << middle << ' ' << fine;
}

// A patchwork of media whose D differs up to tenfold, layers of many thicknesses.
SlabOperator Patchwork(int n, std::uint64_t seed) {
  Mesh mesh{UniformAxis(0, n * 0.4, n),
            UniformAxis(0, n * 0.4, n),
            DepthAxis({.depth_mm = 10, .first_mm = 0.05, .growth = 1.3})};
  RandomStream random(seed, 0);
  std::vector<double> patch(64);
  for (double& d : patch) {
    d = 0.1 * std::pow(10.0, random.Uniform());
  }
  LateralField field;
  const auto at = [&](int i, int j) {
    return patch[static_cast<std::size_t>((j / 5 % 8) * 8 + i / 5 % 8)];
  };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      field.sigma_a_per_mm.push_back(0.002 / at(i, j));
      field.diffusion_mm.push_back(at(i, j));
      field.east_diffusion_mm.push_back(2 / (1 / at(i, j) + 1 / at(i + 1, j)));
      field.north_diffusion_mm.push_back(2 / (1 / at(i, j) + 1 / at(i, j + 1)));
      field.side_decay_per_mm.push_back(0.1);
    }
  }
  return Assemble(mesh, field, {4, 4});
}

int IterationsFor(int n, double tolerance) {
  const SlabOperator op = Patchwork(n, 3);
  MultigridSolver<double> solver(op);
  const std::size_t middle = static_cast<std::size_t>((n / 2) * n + n / 2);
  solver.rhs()[middle * static_cast<std::size_t>(op.nz) + 3].v[0] = 1;
  return solver.Solve(tolerance).iterations;
}

TEST(MultigridSolver, IterationsDoNotGrowWithTheMesh) {
  const int small = IterationsFor(16, 1e-8);
  const int large = IterationsFor(96, 1e-8);
  EXPECT_LE(small, 14);
  EXPECT_LE(large, small + 3) << small << ' ' << large;
}

TEST(MultigridSolver, InverseIsSymmetric) {
  const SlabOperator op = Patchwork(23, 5);  // odd sizes coarsen unevenly
  const auto nz = static_cast<std::size_t>(op.nz);
  MultigridSolver<double> solver(op);
  std::vector<std::size_t> at;
  RandomStream random(1, 1);
  for (std::size_t lane = 0; lane < 8; ++lane) {
    at.push_back(random() % (op.ColumnCount() * nz));
    solver.rhs()[at[lane]].v[lane] = 1;
  }
  solver.Solve(1e-12);
  for (std::size_t a = 0; a < 8; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double one = solver.solution()[at[a]].v[b];
      const double other = solver.solution()[at[b]].v[a];
      EXPECT_NEAR(one / other, 1, 1e-8);
    }
  }
}

TEST(MultigridSolver, FloatsAgreeWithDoubles) {
  const SlabOperator op = Patchwork(40, 7);
  const auto nz = static_cast<std::size_t>(op.nz);
  const std::size_t source = (20 * 40 + 20) * nz + 2;
  MultigridSolver<double> precise(op);
  MultigridSolver<float> quick(op);
  precise.rhs()[source].v[0] = 1;
  quick.rhs()[source].v[11] = 1;
  precise.Solve(1e-12);
  quick.Solve(1e-6);
  for (std::size_t c = 0; c < op.ColumnCount(); ++c) {
    const double expected = precise.solution()[c * nz].v[0];
    const double found = static_cast<double>(float{quick.solution()[c * nz].v[11]});
    EXPECT_NEAR(found / expected, 1, 2e-3) << c;  // also where it is 1e-5 of the peak
  }
}

TEST(MultigridSolver, OtherLanesDoNotMatter) {
  const SlabOperator op = Patchwork(16, 2);
  const auto nz = static_cast<std::size_t>(op.nz);
  MultigridSolver<double> alone(op);
  MultigridSolver<double> crowd(op);
  alone.rhs()[77 * nz].v[0] = 1;
  crowd.rhs()[77 * nz].v[0] = 1;
  crowd.rhs()[99 * nz + 4].v[5] = 3;
  alone.Solve(1e-12);
  crowd.Solve(1e-12);
  for (std::size_t k = 0; k < alone.solution().size(); ++k) {
    const double one = alone.solution()[k].v[0];
    const double other = crowd.solution()[k].v[0];
    EXPECT_NEAR(one, other, 1e-10);
    EXPECT_EQ(double{crowd.solution()[k].v[3]}, 0);  // nothing in, nothing out
  }
}

TEST(MultigridSolver, SaysSoWhenItDoesNotConverge) {
  const SlabOperator op = Patchwork(16, 2);
  MultigridSolver<double> solver(op);
  solver.rhs()[5].v[0] = 1;
  try {
    solver.Solve(1e-12, 2);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("after 2 iterations"));
  }
}

TEST(SlabOperator, CoarseningKeepsAreasLossesAndSeriesConductance) {
  const Mesh mesh = UnitCube(8);
  LateralField field;
  const std::size_t columns = 64;
  field.sigma_a_per_mm.assign(columns, 3);
  field.diffusion_mm.assign(columns, 0.5);
  field.east_diffusion_mm.assign(columns, 0.5);
  field.north_diffusion_mm.assign(columns, 0.5);
  field.side_decay_per_mm.assign(columns, 0);
  const SlabOperator coarse = Coarsen(Assemble(mesh, field, {1, 2}));
  const Mesh half{UniformAxis(0, 1, 4), UniformAxis(0, 1, 4), UniformAxis(0, 1, 8)};
  const SlabOperator direct = Assemble(half, field, {1, 2});
  for (std::size_t c = 0; c < 16; ++c) {
    EXPECT_NEAR(coarse.area_mm2[c], direct.area_mm2[c], 1e-12);
    EXPECT_NEAR(coarse.absorption[c], direct.absorption[c], 1e-12);
    EXPECT_NEAR(coarse.east[c], direct.east[c], 1e-12);
    EXPECT_NEAR(coarse.north[c], direct.north[c], 1e-12);
    EXPECT_NEAR(coarse.top[c], direct.top[c], 1e-12);
    EXPECT_NEAR(coarse.bottom[c], direct.bottom[c], 1e-12);
  }
}

TEST(Mesh, DepthAxisMeetsTheBottomAndGrows) {
  const Axis axis =
      DepthAxis({.depth_mm = 10, .first_mm = 0.1, .growth = 1.25, .thickest_mm = 1});
  EXPECT_EQ(axis.edges_mm.front(), 0);
  EXPECT_EQ(axis.edges_mm.back(), 10);
  EXPECT_NEAR(axis.Width(0), 0.1, 0.02);
  for (int k = 1; k < axis.Count(); ++k) {
    EXPECT_LE(axis.Width(k), 1.0 + 1e-9);
    EXPECT_LE(axis.Width(k) / axis.Width(k - 1), 1.25 + 1e-9);
  }
}

}  // namespace
}  // namespace nacre::rigs::diffusion

#include "rigs/transport/path_averaged.h"

#include "core/error.h"
#include "core/random.h"
#include "rigs/transport/dipole.h"
#include "rigs/transport/multipole.h"
#include "tests/rigs/phantoms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace nacre::rigs {
namespace {

using ::testing::HasSubstr;
using testing::Homogeneous;
using testing::TwoMarbles;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double Exitance(const PathAveraged& model, PointMm x_i, PointMm x_o) {
  const auto x = static_cast<float>(x_o.x);
  const auto y = static_cast<float>(x_o.y);
  float value = 0;
  model.AddExitance(x_i, 0, 1, {&x, &y, 1}, &value);
  return static_cast<double>(value);
}

// A point at a distance drawn evenly in its logarithm.
PointMm Around(RandomStream& random, PointMm centre, double nearest, double farthest) {
  const double r = nearest * std::pow(farthest / nearest, random.Uniform());
  const double angle = 2 * std::numbers::pi * random.Uniform();
  // Rounded as the model gets it.
  return {static_cast<double>(static_cast<float>(centre.x + r * std::cos(angle))),
          static_cast<double>(static_cast<float>(centre.y + r * std::sin(angle)))};
}

PointMm Anywhere(RandomStream& random) {
  const double x = 30 * (random.Uniform() - 0.5);
  return {x, 30 * (random.Uniform() - 0.5)};
}

// The table against the model it was made from: 0.3 % is what was promised.
TEST(PathAveraged, TableErrorIsSmall) {
  std::vector<Phantom> phantoms = {TwoMarbles(PatternType::kChessboard, 5),
                                   TwoMarbles(PatternType::kStripes, 3),
                                   TwoMarbles(PatternType::kChessboard, 31.5)};
  Phantom reversed = phantoms[0];
  std::swap(reversed.media[0], reversed.media[1]);
  phantoms.push_back(reversed);
  Phantom clear = phantoms[0];  // where diffusion goes as the square root of σ_a
  clear.media[0].sigma_a_per_mm = {0.0};
  phantoms.push_back(clear);
  Phantom same_absorption = phantoms[0];
  same_absorption.media[1].sigma_a_per_mm = same_absorption.media[0].sigma_a_per_mm;
  phantoms.push_back(same_absorption);
  RandomStream random(1, 0);
  for (std::size_t p = 0; p < phantoms.size(); ++p) {
    const PathAveraged model(phantoms[p]);
    for (int k = 0; k < 2000; ++k) {
      const PointMm x_i = Anywhere(random);
      const PointMm x_o = Around(random, x_i, 0.02, 50);
      EXPECT_NEAR(Exitance(model, x_i, x_o) / model.Direct(x_i, x_o, 0), 1, 3e-3)
          << "phantom " << p << ", distance "
          << std::hypot(x_o.x - x_i.x, x_o.y - x_i.y);
    }
  }
}

TEST(PathAveraged, OneMediumIsTheMultipole) {
  const PathAveraged slab(Homogeneous(0.0021, 2.19, 10));
  const PathAveraged infinite(Homogeneous(0.0021, 2.19, kInfinity));
  const double factor = BoundaryFactor(1.5);
  const Multipole multipole({0.0021, 2.19}, {10, factor, factor});
  const Dipole dipole({0.0021, 2.19}, factor);
  for (const double r : {0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 8.0, 20.0}) {
    EXPECT_NEAR(Exitance(slab, {0, 0}, {r, 0}) / multipole.Reflectance(r), 1, 1e-3)
        << r;
    EXPECT_NEAR(Exitance(infinite, {0, 0}, {0, r}) / dipole.Reflectance(r), 1, 1e-3)
        << r;
  }
  EXPECT_NEAR(slab.TotalsAt({0, 0}, 0).reflected, multipole.TotalReflectance(), 1e-12);
  EXPECT_NEAR(
      slab.TotalsAt({0, 0}, 0).transmitted, multipole.TotalTransmittance(), 1e-12);
  EXPECT_NEAR(infinite.TotalsAt({3, 4}, 0).reflected, dipole.TotalReflectance(), 1e-12);
}

TEST(PathAveraged, IsReciprocalAndPositive) {
  const PathAveraged model(TwoMarbles(PatternType::kChessboard, 5));
  RandomStream random(2, 0);
  for (int k = 0; k < 3000; ++k) {
    const PointMm a = Around(random, {0, 0}, 0.1, 15);
    const PointMm b = Around(random, a, 0.01, 30);
    const double there = Exitance(model, a, b);
    EXPECT_GT(there, 0);
    EXPECT_NEAR(Exitance(model, b, a) / there, 1, 2e-4);
    EXPECT_NEAR(model.Direct(a, b, 0) / model.Direct(b, a, 0), 1, 2e-4);
  }
}

TEST(PathAveraged, KeepsTheSymmetriesOfTheChessboard) {
  constexpr double kCell = 4;
  const PathAveraged model(TwoMarbles(PatternType::kChessboard, kCell));
  RandomStream random(3, 0);
  for (int k = 0; k < 300; ++k) {
    const PointMm a = Anywhere(random);
    const PointMm b = Around(random, a, 0.05, 12);
    const double value = Exitance(model, a, b);
    const auto same = [&](auto&& map) {
      EXPECT_NEAR(Exitance(model, map(a), map(b)) / value, 1, 5e-4);
    };
    same([&](PointMm p) { return PointMm{p.x + 2 * kCell, p.y}; });
    same([&](PointMm p) { return PointMm{p.x, p.y - 2 * kCell}; });
    same([&](PointMm p) { return PointMm{p.x + kCell, p.y + kCell}; });
    same([&](PointMm p) { return PointMm{p.y, p.x}; });
    same([&](PointMm p) { return PointMm{kCell - p.x, p.y}; });
  }
}

TEST(PathAveraged, ScalingLaw) {
  constexpr double kScale = 2.5;
  const Phantom one = TwoMarbles(PatternType::kChessboard, 4);
  Phantom other = one;
  other.slab.thickness_mm *= kScale;
  other.pattern.cell_mm *= kScale;
  other.grid.pitch_mm *= kScale;
  for (Medium& medium : other.media) {
    medium.sigma_a_per_mm[0] /= kScale;
    medium.sigma_s_per_mm[0] /= kScale;
  }
  const Window a = PathAveraged(one).WindowAround({1.3, -2.2});
  const Window b = PathAveraged(other).WindowAround({1.3 * kScale, -2.2 * kScale});
  for (std::size_t k = 0; k < a.rd.size(); ++k) {
    EXPECT_NEAR(static_cast<double>(b.rd[k] / a.rd[k]) * kScale * kScale, 1, 2e-3);
  }
}

// The mean over a cell from 400 × 400 evenly spaced values.
double MeanByBruteForce(const PathAveraged& model, PointMm x_i, int u, int v) {
  const double pitch = model.phantom().grid.pitch_mm;
  constexpr std::size_t kSide = 400;
  std::vector<float> x(kSide);
  std::vector<float> y(kSide);
  std::vector<float> value(kSide, 0.0F);
  double sum = 0;
  for (std::size_t b = 0; b < kSide; ++b) {
    for (std::size_t a = 0; a < kSide; ++a) {
      const auto part = [](std::size_t k) {
        return (static_cast<double>(k) + 0.5) / kSide - 0.5;
      };
      x[a] = static_cast<float>(x_i.x + (u + part(a)) * pitch);
      y[a] = static_cast<float>(x_i.y + (v + part(b)) * pitch);
    }
    std::fill(value.begin(), value.end(), 0.0F);
    model.AddExitance(x_i, 0, 1, {x.data(), y.data(), kSide}, value.data());
    sum += std::accumulate(value.begin(), value.end(), 0.0);
  }
  return sum / (kSide * kSide);
}

TEST(PathAveraged, WindowsHoldTheMeansOverCells) {
  struct Case {
    Phantom phantom;
    PointMm x_i;
  };
  const std::vector<Case> cases = {
      {Homogeneous(0.0071, 3.0, 10), {0, 0}},
      {TwoMarbles(PatternType::kChessboard, 8), {1, 1}},       // edges along cells
      {TwoMarbles(PatternType::kChessboard, 8), {0.3, -0.2}},  // and across them
      {TwoMarbles(PatternType::kStripes, 5), {3.9, 0.1}},
  };
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const PathAveraged model(cases[k].phantom);
    const Window window = model.WindowAround(cases[k].x_i);
    ASSERT_EQ(window.rd.size(), 81u);
    for (int v = -4; v <= 4; ++v) {
      for (int u = -4; u <= 4; ++u) {
        // Row 0 of a window is its top, v = 4.
        const auto at = static_cast<std::size_t>((4 - v) * 9 + 4 + u);
        const double expected = MeanByBruteForce(model, cases[k].x_i, u, v);
        EXPECT_NEAR(static_cast<double>(window.rd[at]) / expected, 1, 3e-3)
            << "case " << k << ", cell " << u << ", " << v;
      }
    }
  }
}

TEST(PathAveraged, AWideWindowHoldsAllThatLeaves) {
  for (const double pitch_mm : {0.5, 2.0, 6.0}) {
    Phantom phantom = Homogeneous(0.05, 3.0, 10);
    phantom.grid.pitch_mm = pitch_mm;
    phantom.grid.core = 2 * static_cast<int>(20 / pitch_mm) + 1;
    const PathAveraged model(phantom);
    const Window window = model.WindowAround({0.4, 0.7});
    const double sum =
        std::accumulate(window.rd.begin(), window.rd.end(), 0.0) * pitch_mm * pitch_mm;
    EXPECT_NEAR(sum / model.TotalsAt({0, 0}, 0).reflected, 1, 1e-3) << pitch_mm;
  }
}

TEST(PathAveraged, EnergyIsBounded) {
  const PathAveraged model(TwoMarbles(PatternType::kChessboard, 5));
  const Totals white = PathAveraged(Homogeneous(0.0021, 2.19, 10)).TotalsAt({}, 0);
  const Totals dark = PathAveraged(Homogeneous(0.06, 1.0, 10)).TotalsAt({}, 0);
  for (const PointMm x_i : {PointMm{2.5, 2.5}, {0.1, 2.5}, {-2.5, 2.5}, {-0.1, 0.1}}) {
    const Totals totals = model.TotalsAt(x_i, 0);
    EXPECT_GT(totals.reflected, dark.reflected);
    EXPECT_LT(totals.reflected, white.reflected);
    EXPECT_GT(totals.transmitted, dark.transmitted);
    EXPECT_LT(totals.transmitted, white.transmitted);
    EXPECT_GT(totals.absorbed, 0);
    EXPECT_NEAR(totals.reflected + totals.transmitted + totals.absorbed, 1, 1e-12);
  }
}

TEST(PathAveraged, BottomsDifferAsTheyShould) {
  const auto totals = [](Bottom bottom) {
    Phantom phantom = Homogeneous(0.01, 1.0, 4);
    phantom.slab.bottom = bottom;
    return PathAveraged(phantom).TotalsAt({}, 0);
  };
  const Totals black = totals(Bottom::kBlack);
  const Totals matched = totals(Bottom::kMatched);
  EXPECT_EQ(black.reflected, matched.reflected);
  EXPECT_EQ(black.transmitted, 0);
  EXPECT_NEAR(black.absorbed, matched.absorbed + matched.transmitted, 1e-12);
  EXPECT_GT(totals(Bottom::kAir).reflected, matched.reflected);
  EXPECT_GT(totals(Bottom::kWhite).reflected, totals(Bottom::kAir).reflected);
  EXPECT_EQ(totals(Bottom::kWhite).transmitted, 0);
}

// A Gaussian beam against the sum over many pencils.
TEST(PathAveraged, RoundAndSquareBeamsAreMadeOfPencils) {
  const Phantom pencil = TwoMarbles(PatternType::kChessboard, 20);
  const PathAveraged by_pencil(pencil);
  for (const BeamShape shape :
       {BeamShape::kGaussian, BeamShape::kDisc, BeamShape::kSquare}) {
    Phantom phantom = pencil;
    phantom.beam = {.shape = shape, .width_mm = 1.6};
    const PathAveraged model(phantom);
    for (const PointMm x_o : {PointMm{5, 5}, {5.3, 5.2}, {6.5, 5}, {9, 8}}) {
      double sum = 0;
      double weight_sum = 0;
      constexpr int kSide = 120;
      for (int k = 0; k < kSide * kSide; ++k) {
        const double x = 4 * ((k % kSide + 0.5) / kSide - 0.5);
        const double y = 4 * ((static_cast<double>(k / kSide) + 0.5) / kSide - 0.5);
        const double r2 = x * x + y * y;
        double weight = std::max(std::abs(x), std::abs(y)) < 0.8 ? 1 : 0;
        if (shape == BeamShape::kDisc) {
          weight = r2 < 0.64 ? 1 : 0;
        } else if (shape == BeamShape::kGaussian) {
          weight = std::exp(-r2 / (2 * 0.4 * 0.4));
        }
        weight_sum += weight;
        sum += weight * Exitance(by_pencil, {5 + x, 5 + y}, x_o);
      }
      EXPECT_NEAR(Exitance(model, {5, 5}, x_o) / (sum / weight_sum), 1, 5e-3)
          << Name(shape) << " at " << x_o.x;
    }
  }
}

TEST(PathAveraged, ThreadsChangeNothing) {
  const Phantom phantom = TwoMarbles(PatternType::kChessboard, 5);
  const Window one = PathAveraged(phantom, 1).WindowAround({0.3, 0.4});
  const Window three = PathAveraged(phantom, 3).WindowAround({0.3, 0.4});
  EXPECT_EQ(one.rd, three.rd);
}

TEST(PathAveraged, RefusesWhatDiffusionCannotDo) {
  Phantom oblique = Homogeneous(0.01, 1, 10);
  oblique.beam.angle_rad = 0.1;
  EXPECT_THAT([&] { PathAveraged{oblique}; },
              ::testing::ThrowsMessage<Error>(HasSubstr("beam.angle_deg")));
  EXPECT_THAT(
      [] { PathAveraged{Homogeneous(0.01, 0, 10)}; },
      ::testing::ThrowsMessage<Error>(HasSubstr("doesn't scatter in channel Y")));
  EXPECT_THAT(
      [] { PathAveraged{Homogeneous(0.01, 0.1, 5)}; },
      ::testing::ThrowsMessage<Error>(HasSubstr("less than the mean free path")));
}

TEST(Solvers, AreNamed) {
  EXPECT_EQ(ParseSolver("fast"), Solver::kFast);
  EXPECT_EQ(ParseSolver("auto"), Solver::kAuto);
  EXPECT_THAT([] { ParseSolver("photon soup"); },
              ::testing::ThrowsMessage<Error>(HasSubstr("there are: auto, fast")));
}

}  // namespace
}  // namespace nacre::rigs

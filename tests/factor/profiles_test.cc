// Gaussian profiles: nonnegative least squares by the conditions of its solution, the
// fit by data made of profiles.

#include "factor/internal/profiles.h"

#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "factor/internal/nonnegative_solve.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace nacre::factor::internal {
namespace {

using nacre::testing::MakeChessboard;
using reconstruct::RdDataset;

TEST(SolveNonnegative, MeetsTheConditionsOfTheSolution) {
  RandomStream random(1, 0);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Index size = 1 + n % 9;
    const auto draw = [&] { return random.Uniform() - 0.5; };
    const Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(size + 3, size, draw);
    const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(size + 3, draw);
    const Eigen::MatrixXd gram = a.transpose() * a;
    const Eigen::VectorXd cross = a.transpose() * b;
    const Eigen::VectorXd x = SolveNonnegative(gram, cross);
    const Eigen::VectorXd slope = cross - gram * x;
    // Karush, Kuhn and Tucker: no way down that is allowed.
    for (Eigen::Index j = 0; j < size; ++j) {
      EXPECT_GE(x(j), 0);
      EXPECT_LT(slope(j), 1e-9);
      EXPECT_LT(std::abs(slope(j) * x(j)), 1e-9);
    }
  }
}

TEST(SolveNonnegative, TheSameColumnTwiceIsNoTrouble) {
  Eigen::MatrixXd gram(3, 3);
  gram << 2, 2, 0, 2, 2, 0, 0, 0, 0;
  const Eigen::VectorXd x = SolveNonnegative(gram, Eigen::Vector3d(4, 4, 0));
  EXPECT_NEAR(x(0) + x(1), 2, 1e-9);
  EXPECT_EQ(x(2), 0);
}

TEST(Profiles, AGaussianHasUnitVolume) {
  const Gaussian gaussian(4.0, 40, 0.1);
  double sum = 0;
  for (int v = -40; v <= 40; ++v) {
    for (int u = -40; u <= 40; ++u) {
      sum += gaussian.At(u, v) * 0.01;
    }
  }
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_NEAR(gaussian.At(3, -4),
              4 / (2 * std::numbers::pi) * std::exp(-0.5 * 4 * 0.25),
              1e-12);
}

Material MakeProfiles(int points_x, int points_y, int margin) {
  Material m = nacre::testing::MakeMaterial(3);
  m.method = "profiles";
  m.form = Form::kProfiles;
  m.transform = Transform::kLinear;
  m.points_x = points_x;
  m.points_y = points_y;
  m.core = 9;
  m.pitch_mm = 0.25;
  m.cluster_count = 1;
  m.margin = margin;
  m.terms = 2;
  const auto points = static_cast<std::size_t>(points_x * points_y);
  m.cluster.assign(points, 0);
  m.row_scale.assign(3 * points, 1);
  m.albedo.assign(3 * points, 0.5F);
  m.f.clear();
  for (int c = 0; c < 3; ++c) {
    for (int t = 0; t < 2; ++t) {
      for (int y = 0; y < m.MapHeight(); ++y) {
        for (int x = 0; x < m.MapWidth(); ++x) {
          m.f.push_back(static_cast<float>(
              0.3 + 0.1 * t + 0.1 * std::sin(0.5 * x + c) * std::cos(0.4 * y)));
        }
      }
    }
  }
  m.h = {std::log(60.0F),
         std::log(3.0F),
         std::log(50.0F),
         std::log(2.0F),
         std::log(40.0F),
         std::log(1.5F)};
  return m;
}

RdDataset Sampled(const Material& m) {
  RdDataset dataset =
      MakeChessboard({.points_x = m.points_x, .points_y = m.points_y, .core = m.core});
  for (int j = 0; j < m.points_y; ++j) {
    for (int i = 0; i < m.points_x; ++i) {
      for (int c = 0; c < 3; ++c) {
        m.EvaluateWindow(
            c,
            i,
            j,
            &dataset.rd[static_cast<std::size_t>(((j * m.points_x + i) * 3 + c) * 81)]);
      }
    }
  }
  return dataset;
}

TEST(Profiles, IsReciprocalToTheLastBit) {
  for (const int margin : {0, 4}) {
    const Material m = MakeProfiles(10, 8, margin);
    std::vector<float> window(81);
    for (int n = 0; n < 80; ++n) {
      m.EvaluateWindow(n % 3, n % 10, n / 10, window.data());
      for (int cell = 0; cell < 81; ++cell) {
        const int u = cell % 9;
        const int v = cell / 9;
        const int i = n % 10 + u - 4;
        const int j = n / 10 + v - 4;
        const float value = m.Evaluate(n % 3, n % 10, n / 10, u, v);
        EXPECT_EQ(window[static_cast<std::size_t>(cell)], value);
        EXPECT_GT(value, 0);
        if (i >= 0 && i < 10 && j >= 0 && j < 8) {
          EXPECT_EQ(m.Evaluate(n % 3, i, j, 8 - u, 8 - v), value);
        }
      }
    }
  }
}

TEST(Profiles, DataOfItsOwnFormAreFitted) {
  const RdDataset dataset = Sampled(MakeProfiles(16, 14, 4));
  const auto [m, summary] =
      Factor(dataset, {.method = "profiles", .terms = 2, .bits = 32});
  EXPECT_EQ(m.form, Form::kProfiles);
  EXPECT_LT(summary.relative_l2, 0.02);
  // The widths that were put in, √(1/β), but for what the mean of products differs
  // from the product of means.
  for (int c = 0; c < 3; ++c) {
    const double truth[] = {std::log(60.0 - 10 * c), std::log(3.0 - c + (c > 1) * 0.5)};
    for (int t = 0; t < 2; ++t) {
      EXPECT_NEAR(static_cast<double>(m.Kernel(c, 0, t)[0]), truth[t], 0.15)
          << c << ' ' << t;
    }
  }
}

TEST(Profiles, RoundsLowerTheErrorOfWhatIsNoProfile) {
  const RdDataset dataset = MakeChessboard({.points_x = 20, .points_y = 16, .core = 9});
  const auto one = Factor(dataset, {.method = "gaussian", .terms = 1});
  const auto four = Factor(dataset, {.method = "gaussian", .terms = 4});
  EXPECT_LT(four.summary.relative_l2, 0.5 * one.summary.relative_l2);
  EXPECT_LT(four.summary.relative_l2, 0.1);
}

TEST(Profiles, WhatWasNotMeasuredIsNotLookedAt) {
  RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 10, .core = 7});
  const double plain = Factor(dataset, {.method = "profiles", .terms = 3, .bits = 32})
                           .summary.relative_l2;
  RandomStream random(2, 0);
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    if (random.Uniform() < 0.2) {
      dataset.valid[n] = 0;
      dataset.rd[n] = 1000;
    }
  }
  const double masked = Factor(dataset, {.method = "profiles", .terms = 3, .bits = 32})
                            .summary.relative_l2;
  EXPECT_LT(masked, 1.2 * plain);
}

TEST(Profiles, TheFileKeepsEveryBitRoundedOrNot) {
  const nacre::testing::TempFolder folder;
  const RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 10, .core = 7});
  for (const double bits : {0.0, 10.0, 32.0}) {
    const auto [m, summary] =
        Factor(dataset, {.method = "profiles", .terms = 3, .bits = bits});
    WriteMaterial(folder / "m.nacre.exr", m);
    EXPECT_EQ(std::filesystem::file_size(folder / "m.nacre.exr"),
              static_cast<std::uintmax_t>(summary.bytes));
    const Material read = ReadMaterial(folder / "m.nacre.exr");
    EXPECT_EQ(read.f, m.f);
    EXPECT_EQ(read.h, m.h);
    EXPECT_EQ(read.margin, 3);
  }
}

TEST(Profiles, NegativeWeightsAreRefused) {
  Material m = MakeProfiles(5, 4, 1);
  m.f[7] = -0.1F;
  EXPECT_THROW(Validate(m, "m"), Error);
  m.f[7] = 0.1F;
  m.h[1] = 100;
  EXPECT_THROW(Validate(m, "m"), Error);
}

TEST(Profiles, ThreadCountsGiveTheSameBits) {
  const RdDataset dataset = MakeChessboard({.points_x = 30, .points_y = 20, .core = 7});
  const Material one =
      Factor(dataset, {.method = "profiles", .terms = 3, .thread_count = 1}).material;
  for (const int threads : {2, 3}) {
    const Material m =
        Factor(dataset, {.method = "profiles", .terms = 3, .thread_count = threads})
            .material;
    EXPECT_EQ(m.f, one.f);
    EXPECT_EQ(m.h, one.h);
  }
}

}  // namespace
}  // namespace nacre::factor::internal

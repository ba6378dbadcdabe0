#include "factor/internal/hals.h"

#include "core/random.h"
#include "factor/factor.h"
#include "tests/factor/synthetic.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace nacre::factor::internal {
namespace {

RowMatrix Random(int rows, int columns, std::uint64_t seed) {
  RandomStream random(seed, 0);
  return RowMatrix::NullaryExpr(rows, columns, [&] { return random.Uniform(); });
}

// The published updates [Lee01, eq. 4], as the oracle.
Nonnegative Multiplicative(const RowMatrix& y, int terms, int rounds) {
  Nonnegative model{Random(static_cast<int>(y.rows()), terms, 8),
                    Random(terms, static_cast<int>(y.cols()), 9)};
  for (int round = 0; round < rounds; ++round) {
    const Eigen::MatrixXd hy = y * model.h.transpose();
    const Eigen::MatrixXd hh = model.f * (model.h * model.h.transpose());
    model.f.array() *= hy.array() / (hh.array() + 1e-300);
    const RowMatrix fy = model.f.transpose() * y;
    const RowMatrix ff = (model.f.transpose() * model.f) * model.h;
    model.h.array() *= fy.array() / (ff.array() + 1e-300);
  }
  return model;
}

double ModelError(const RowMatrix& y, const Nonnegative& model) {
  return (y - model.f * model.h).norm() / y.norm();
}

TEST(Hals, NothingIsNegativeAndNoSweepMakesItWorse) {
  const RowMatrix y = Random(40, 30, 1);
  RowMatrix h = Random(6, 30, 2);
  Eigen::MatrixXd f = Eigen::MatrixXd::Ones(40, 6);
  double before = 1e300;
  for (int sweep = 0; sweep < 20; ++sweep) {
    HalsSweep(h * h.transpose(), y * h.transpose(), f);
    const double error = (y - f * h).norm();
    EXPECT_LE(error, before * (1 + 1e-12));
    EXPECT_GE(f.minCoeff(), 0);
    before = error;
  }
}

TEST(Hals, AsGoodAsManyMultiplicativeUpdates) {
  const RowMatrix y = Random(60, 8, 3) * Random(8, 50, 4) + 0.02 * Random(60, 50, 5);
  const double ours =
      ModelError(y, FactorNonnegative(y, {}, {.terms = 6, .rounds = 100, .seed = 1}));
  EXPECT_LT(ours, 1.03 * ModelError(y, Multiplicative(y, 6, 2000)));
}

TEST(Hals, DataOfThatFormAreFound) {
  // Parts that don't overlap everywhere have one factorization only [Donoho03].
  RowMatrix h = RowMatrix::Zero(3, 12);
  for (int j = 0; j < 3; ++j) {
    h.row(j).segment(4 * j, 4).setLinSpaced(1, 2 + j);
  }
  const RowMatrix y = Random(50, 3, 6) * h;
  EXPECT_LT(
      ModelError(y, FactorNonnegative(y, {}, {.terms = 3, .rounds = 500, .seed = 1})),
      1e-4);
}

TEST(Hals, NegativeAndZeroRowsAreLeftAtZero) {
  RowMatrix y = Random(5, 7, 7);
  y.row(2).setZero();
  y.row(3) *= -1;
  const Nonnegative model =
      FactorNonnegative(y, {}, {.terms = 3, .rounds = 100, .seed = 1});
  EXPECT_TRUE(model.f.allFinite());
  EXPECT_GE(model.f.minCoeff(), 0);
  EXPECT_GE(model.h.minCoeff(), 0);
  EXPECT_LT(model.f.row(2).norm(), 1e-9);
  EXPECT_LT(model.f.row(3).norm(), 1e-9);
}

TEST(NmfMethod, NothingIsNegativeAndThreadsDoNotMatter) {
  // More points than the sample has.
  const reconstruct::RdDataset dataset = nacre::testing::MakeChessboard(
      {.points_x = 50, .points_y = 45, .core = 5, .channels = 2, .noise = 1e-3});
  FactorOptions options{.method = "nmf", .terms = 4, .clusters = 2, .bits = 32};
  options.thread_count = 1;
  const Material one = Factor(dataset, options).material;
  EXPECT_GE(*std::min_element(one.f.begin(), one.f.end()), 0);
  EXPECT_GE(*std::min_element(one.h.begin(), one.h.end()), 0);
  EXPECT_LT(one.error.at("relative_l2"), 0.1);
  for (const int threads : {2, 3}) {
    options.thread_count = threads;
    const Material m = Factor(dataset, options).material;
    EXPECT_EQ(m.f, one.f);
    EXPECT_EQ(m.h, one.h);
  }
}

}  // namespace
}  // namespace nacre::factor::internal

#include "factor/internal/truncated_svd.h"

#include "core/random.h"
#include "factor/internal/transform_search.h"
#include "tests/factor/exact_svd.h"

#include <gtest/gtest.h>

namespace nacre::factor::internal {
namespace {

using nacre::testing::ComputeExactSvd;
using nacre::testing::ExactSvd;

// Random matrix with singular values that fall geometrically.
RowMatrix Decaying(int rows, int columns, double ratio, std::uint64_t seed) {
  RandomStream random(seed, 0);
  const auto draw = [&] { return random.Uniform() - 0.5; };
  const Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(rows, columns, draw);
  const ExactSvd svd = ComputeExactSvd(a);
  Eigen::VectorXd sigma(svd.sigma.size());
  for (Eigen::Index j = 0; j < sigma.size(); ++j) {
    sigma(j) = 3 * std::pow(ratio, static_cast<double>(j));
  }
  return svd.u * sigma.asDiagonal() * svd.v.transpose();
}

// The thesis' way: the leading term of the residual is found by power iteration, taken
// away, and so on, S times.
Eigen::MatrixXd OneTermAtATime(const RowMatrix& y, int terms) {
  Eigen::MatrixXd residual = y;
  for (int term = 0; term < terms; ++term) {
    Eigen::VectorXd v =
        residual.row(0).transpose() + Eigen::VectorXd::Constant(residual.cols(), 1e-3);
    for (int step = 0; step < 3000; ++step) {
      v = (residual.transpose() * (residual * v)).normalized();
    }
    residual -= (residual * v) * v.transpose();
  }
  return y - residual;
}

struct Shape {
  int rows, columns, terms;
};

class TruncatedSvdShapes : public ::testing::TestWithParam<Shape> {};

TEST_P(TruncatedSvdShapes, EqualsJacobi) {
  const auto [rows, columns, terms] = GetParam();
  const RowMatrix y = Decaying(rows, columns, 0.7, 3);
  const TruncatedSvd svd = ComputeTruncatedSvd(y, terms);
  ASSERT_EQ(svd.sigma.size(), terms);
  const Eigen::MatrixXd model = svd.scores * svd.basis.transpose();
  const Eigen::MatrixXd oracle = ComputeExactSvd(y).OfRank(terms);
  EXPECT_LT((model - oracle).norm() / oracle.norm(), 1e-9);
  for (int j = 0; j < terms; ++j) {
    EXPECT_NEAR(svd.sigma(j), 3 * std::pow(0.7, j), 1e-7);
  }
  EXPECT_LT(
      (svd.basis.transpose() * svd.basis - Eigen::MatrixXd::Identity(terms, terms))
          .norm(),
      1e-6);
}

// Tall, wide, square; by Lanczos (few terms of many) and by the dense solver.
INSTANTIATE_TEST_SUITE_P(Shapes,
                         TruncatedSvdShapes,
                         ::testing::Values(Shape{200, 90, 6},
                                           Shape{90, 200, 6},
                                           Shape{60, 60, 10},
                                           Shape{40, 25, 12},
                                           Shape{1, 9, 1},
                                           Shape{9, 1, 1}));

TEST(TruncatedSvd, OneTermAtATimeIsTheSame) {
  const RowMatrix y = Decaying(60, 25, 0.6, 5);
  const TruncatedSvd svd = ComputeTruncatedSvd(y, 8);
  const Eigen::MatrixXd model = svd.scores * svd.basis.transpose();
  EXPECT_LT((model - OneTermAtATime(y, 8)).norm() / y.norm(), 1e-10);
}

TEST(TruncatedSvd, RankBelowTermsGivesFewerTerms) {
  for (const int side : {20, 120}) {
    const RowMatrix y = Decaying(side, side, 0.5, 7);
    const RowMatrix rank_three = ComputeExactSvd(y).OfRank(3);
    const TruncatedSvd svd = ComputeTruncatedSvd(rank_three, 10);
    EXPECT_EQ(svd.sigma.size(), 3) << side;
    EXPECT_LT((svd.scores * svd.basis.transpose() - rank_three).norm(), 1e-10);
  }
}

TEST(TruncatedSvd, ZerosHaveNoTerms) {
  EXPECT_EQ(ComputeTruncatedSvd(RowMatrix::Zero(7, 5), 3).sigma.size(), 0);
}

// YᵀY of m rows is off by m u ‖Y‖² at most, its eigenvalues by as much (Weyl), by n u
// ‖Y‖² of the dense solver or 10⁻¹³ ‖Y‖² of Lanczos': ε in all. So are the σ², and k
// terms take at most 2 k ε ‖Y‖² more of ‖Y − Ŷ‖² than the best do, and leave out what
// is below the tolerance for a rank. Wide matrices' basis is Yᵀu / σ: as much again
// over σ, for each term.
void ExpectBestOfItsRank(const RowMatrix& y, int terms) {
  const TruncatedSvd svd = ComputeTruncatedSvd(y, terms);
  const Eigen::VectorXd sigma = ComputeExactSvd(y).sigma;
  const double squares = y.squaredNorm();
  const double epsilon = static_cast<double>(y.rows() + y.cols()) * 0x1p-53 + 1e-13;
  double best = sigma.tail(sigma.size() - terms).squaredNorm();
  best += terms * (2 * epsilon + kRankTolerance * kRankTolerance) * squares;
  double bound = std::sqrt(best);
  for (Eigen::Index j = 0; j < svd.sigma.size(); ++j) {
    EXPECT_LE(std::abs(std::pow(svd.sigma(j), 2) - std::pow(sigma(j), 2)),
              epsilon * squares)
        << j;
    bound += y.rows() < y.cols() ? 2 * epsilon * squares / svd.sigma(j) : 0;
  }
  // No term is missing that the tolerance can't have hidden.
  const double hidden = std::pow(kRankTolerance * sigma(0), 2) + 2 * epsilon * squares;
  if (svd.sigma.size() < terms) {
    EXPECT_LE(std::pow(sigma(svd.sigma.size()), 2), hidden);
  }
  EXPECT_LE((svd.scores * svd.basis.transpose() - y).norm(), bound);
  EXPECT_TRUE(svd.scores.allFinite() && svd.basis.allFinite());
}

TEST(TruncatedSvd, WorstConditions) {
  const double decade = std::pow(10, -12.0 / 24);  // 12 decades in 25 columns
  for (const int terms : {3, 12, 25}) {
    ExpectBestOfItsRank(Decaying(40, 25, decade, 17), terms);
    ExpectBestOfItsRank(Decaying(25, 40, decade, 18), terms);
  }
  ExpectBestOfItsRank(Decaying(150, 130, 0.5, 19), 8);  // by Lanczos
  ExpectBestOfItsRank(Decaying(130, 150, 0.5, 20), 8);
  RowMatrix hilbert(40, 25);
  RowMatrix graded = Decaying(40, 25, 0.9, 21);
  RowMatrix twins = Decaying(40, 25, 0.9, 22);
  for (Eigen::Index i = 0; i < 40; ++i) {
    for (Eigen::Index j = 0; j < 25; ++j) {
      hilbert(i, j) = 1 / static_cast<double>(i + j + 1);
    }
    graded.row(i) *= std::pow(10, -12.0 * static_cast<double>(i) / 39);
    if (i % 2 == 1) {  // by turns the same row and one that is nearly so
      twins.row(i) = twins.row(i - 1) * (i % 4 == 1 ? 1 : 1 + 1e-12);
    }
  }
  for (const double scale : {1.0, 1e-30, 1e30}) {
    for (const int terms : {2, 10}) {
      ExpectBestOfItsRank(scale * hilbert, terms);
      ExpectBestOfItsRank(scale * graded, terms);
      ExpectBestOfItsRank(scale * twins, terms);
      ExpectBestOfItsRank(scale * graded.transpose(), terms);
    }
  }
}

TEST(TruncatedSvd, SignsAreCanonical) {
  const RowMatrix y = Decaying(30, 20, 0.5, 11);
  const TruncatedSvd svd = ComputeTruncatedSvd(y, 4);
  const TruncatedSvd negated = ComputeTruncatedSvd(-y, 4);
  EXPECT_LT((svd.basis - negated.basis).norm(), 1e-7);
  for (int j = 0; j < 4; ++j) {
    EXPECT_GT(svd.basis.col(j).maxCoeff(), -svd.basis.col(j).minCoeff());
  }
}

TEST(TransformSearch, FindsTheTransformThatMakesRankOne) {
  // ln(R/A + 1) is exactly f · h for A = 0.02; other transforms leave a residual.
  const RowTransform truth{true, 0.02, 1};
  RandomStream random(5, 0);
  Eigen::VectorXd f(80);
  Eigen::VectorXd h(49);
  for (double& value : f) {
    value = 0.7 + random.Uniform();
  }
  for (double& value : h) {
    value = 0.7 + 2 * random.Uniform();
  }
  const RowMatrix rd =
      (f * h.transpose()).unaryExpr([&](double s) { return truth.Inverse(s); });
  const double peak = rd.maxCoeff();
  const TransformSearch search{.terms = 1, .peak = peak};
  const TransformChoice choice = ChooseTransform(rd, search);
  EXPECT_LT(TransformObjective(rd, truth, search), 1e-7);
  EXPECT_LT(choice.objective, 0.02);
  EXPECT_LT(choice.objective,
            0.3 * TransformObjective(rd, {true, 100 * peak, 1}, search));
  EXPECT_NEAR(std::log(choice.transform.a * choice.transform.b),
              std::log(truth.a * truth.b),
              0.5);
}

TEST(TransformSearch, NegativeValuesKeepTheArgumentPositive) {
  RowMatrix rd = Decaying(40, 25, 0.4, 13).cwiseAbs();
  const double peak = rd.maxCoeff();
  rd(3, 4) = -0.4 * peak;
  const TransformChoice choice =
      ChooseTransform(rd, {.terms = 3, .peak = peak, .least = -0.4 * peak});
  EXPECT_GE(choice.transform.a * choice.transform.b, 0.799 * peak);
  EXPECT_TRUE(std::isfinite(choice.objective));
}

TEST(RowTransform, KeepsTheTails) {
  const RowTransform transform{true, 10, 1};
  for (const double rd : {1e-12, 1e-6, 0.3, 40.0, -0.5}) {
    EXPECT_NEAR(transform.Inverse(transform.Forward(rd)) / rd, 1, 1e-12) << rd;
  }
  // Against the formula as printed.
  EXPECT_DOUBLE_EQ((RowTransform{true, 0.5, 0.2}.Forward(3)), std::log(3 / 0.5 + 0.2));
}

}  // namespace
}  // namespace nacre::factor::internal

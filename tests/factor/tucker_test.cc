// The Tucker model: kernels against tensors of known rank, the whole against data made
// of it.

#include "factor/internal/tucker.h"

#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "factor/internal/tucker_als.h"
#include "tests/factor/exact_svd.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <Eigen/QR>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

using nacre::testing::MakeChessboard;
using reconstruct::RdDataset;

Eigen::MatrixXd RandomMatrix(Eigen::Index rows,
                             Eigen::Index columns,
                             std::uint64_t seed) {
  RandomStream random(seed, 0);
  return Eigen::MatrixXd::NullaryExpr(
      rows, columns, [&] { return random.Uniform() - 0.4; });
}

// Rows of a tensor of multilinear rank (`terms`, `rank`, `rank`): mixtures of kernels
// A C_t Bᵀ.
Eigen::MatrixXd LowRankRows(int core, int points, int terms, int rank) {
  const Eigen::MatrixXd a = RandomMatrix(core, rank, 1);
  const Eigen::MatrixXd b = RandomMatrix(core, rank, 2);
  Eigen::MatrixXd kernels(core * core, terms);
  for (int t = 0; t < terms; ++t) {
    const RowMatrix kernel =
        a * RandomMatrix(rank, rank, 10 + static_cast<std::uint64_t>(t)) *
        b.transpose();
    kernels.col(t) = Eigen::Map<const Eigen::VectorXd>(kernel.data(), core * core);
  }
  return RandomMatrix(points, terms, 3) * kernels.transpose();
}

Eigen::MatrixXd LowerGram(const Eigen::MatrixXd& y) {
  return (y.transpose() * y).triangularView<Eigen::Lower>();
}

double RelativeError(const Eigen::MatrixXd& y, const Eigen::MatrixXd& kernels) {
  return (y - y * CoordinatesOf(kernels) * kernels.transpose()).norm() / y.norm();
}

TEST(TuckerAls, RecoversATensorOfLowMultilinearRank) {
  for (const auto& [terms, rank] : {std::pair{1, 1}, {1, 3}, {3, 2}, {4, 3}}) {
    const Eigen::MatrixXd y = LowRankRows(7, 60, terms, rank);
    const Eigen::MatrixXd kernels =
        TuckerKernels(LowerGram(y), 7, {.terms = 10, .window_rank = rank});
    EXPECT_EQ(kernels.cols(), terms) << rank;
    EXPECT_LT(RelativeError(y, kernels), 1e-6) << terms << ' ' << rank;
  }
}

TEST(TuckerAls, ASumOfSeparableKernelsIsFoundByAsManyTerms) {
  // Rank-one terms whose sides are orthogonal: those of the paper find each.
  const Eigen::MatrixXd sides = RandomMatrix(6, 6, 4).householderQr().householderQ();
  Eigen::MatrixXd kernels(36, 3);
  for (int t = 0; t < 3; ++t) {
    const RowMatrix kernel = sides.col(t) * sides.col(5 - t).transpose();
    kernels.col(t) = Eigen::Map<const Eigen::VectorXd>(kernel.data(), 36);
  }
  const Eigen::Vector3d sizes(9, 3, 1);
  const Eigen::MatrixXd f = RandomMatrix(50, 50, 5).householderQr().householderQ();
  const Eigen::MatrixXd y = f.leftCols(3) * sizes.asDiagonal() * kernels.transpose();
  const Eigen::MatrixXd found = TuckerKernels(LowerGram(y), 6, {.terms = 3});
  ASSERT_EQ(found.cols(), 3);
  EXPECT_LT(RelativeError(y, found), 1e-6);
  for (int t = 0; t < 3; ++t) {
    EXPECT_NEAR(std::abs(found.col(t).dot(kernels.col(t))), 1, 1e-6);
  }
}

TEST(TuckerAls, NoRoundTakesLess) {
  const Eigen::MatrixXd y = RandomMatrix(80, 49, 6);
  double before = 0;
  int rounds = 0;
  int last_term = 0;
  const Eigen::MatrixXd kernels = TuckerKernels(
      LowerGram(y),
      7,
      {.terms = 6, .window_rank = 2, .on_round = [&](int term, double captured) {
         // A term's first guess may take less than the last term's.
         EXPECT_GE(captured, before - 1e-12);
         EXPECT_LE(captured, 1 + 1e-12);
         before = captured;
         last_term = term;
         ++rounds;
       }});
  EXPECT_EQ(last_term, 5);
  EXPECT_GT(rounds, 12);
  for (Eigen::Index t = 0; t < kernels.cols(); ++t) {
    const RowMatrix kernel = Eigen::Map<const RowMatrix>(kernels.col(t).data(), 7, 7);
    const Eigen::VectorXd values = nacre::testing::ComputeExactSvd(kernel).sigma;
    EXPECT_LT(values(2), 1e-12 * values(0));
  }
}

TEST(TuckerAls, FullRankOfTheWindowIsTheTruncatedSvd) {
  const Eigen::MatrixXd y = LowRankRows(5, 70, 9, 5);
  const Eigen::MatrixXd kernels =
      TuckerKernels(LowerGram(y), 5, {.terms = 4, .window_rank = 5});
  const Eigen::VectorXd sigma = nacre::testing::ComputeExactSvd(y).sigma;
  const double left = sigma.tail(sigma.size() - 4).norm() / sigma.norm();
  EXPECT_NEAR(RelativeError(y, kernels), left, 1e-6 * left);
}

TEST(Tucker, ShiftsGoAroundTheWindow) {
  for (std::int64_t shift = 0; shift < 25; ++shift) {
    EXPECT_EQ(ShiftedCell(5, shift, shift), 0);
    std::vector<int> seen(25, 0);
    for (std::int64_t cell = 0; cell < 25; ++cell) {
      ++seen[static_cast<std::size_t>(ShiftedCell(5, shift, cell))];
    }
    EXPECT_EQ(*std::min_element(seen.begin(), seen.end()), 1);
  }
}

// Slices with their maximum anywhere, a separable fall-off and channels that are
// polynomials of each other.
RdDataset MakeTuckerData() {
  RdDataset dataset = MakeChessboard({.points_x = 14, .points_y = 11, .core = 7});
  RandomStream random(4, 0);
  const auto window = static_cast<std::size_t>(dataset.header.WindowSize());
  for (std::int64_t point = 0; point < dataset.header.PointCount(); ++point) {
    const auto shift = static_cast<std::int64_t>(random.Uniform() * 49);
    const double scale = 0.5 + random.Uniform();
    const double mixture = random.Uniform();
    for (std::size_t cell = 0; cell < window; ++cell) {
      const std::int64_t place = ShiftedCell(7, shift, static_cast<std::int64_t>(cell));
      const auto u = static_cast<double>(place % 7);
      const auto v = static_cast<double>(place / 7);
      const double x = scale * (std::exp(-0.5 * u - 0.7 * v) +
                                mixture * 0.3 * std::exp(-0.1 * u - 0.2 * v));
      float* rd = &dataset.rd[static_cast<std::size_t>(point) * 3 * window + cell];
      rd[0] = static_cast<float>(x);
      rd[window] = static_cast<float>(1.1 * x);
      rd[2 * window] = static_cast<float>(0.9 * x);
    }
  }
  return dataset;
}

TEST(Tucker, DataOfItsOwnFormAreExact) {
  const RdDataset dataset = MakeTuckerData();
  const auto full = Factor(
      dataset,
      {.method = "tucker", .terms = 2, .bits = 32, .polynomial = 1, .window_rank = 0});
  EXPECT_EQ(full.material.form, Form::kTucker);
  EXPECT_LT(full.summary.relative_l2, 1e-6);
  EXPECT_EQ(full.summary.passes, 4);
}

TEST(Tucker, MoreTermsAndHigherOrdersAreBetter) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 18, .core = 11});
  double before = 1;
  for (const int terms : {1, 3, 6}) {
    const double error =
        Factor(dataset, {.method = "tucker", .terms = terms}).summary.relative_l2;
    EXPECT_LT(error, before);
    before = error;
  }
  before = 1;
  for (const int order : {1, 2, 4}) {
    const double error =
        Factor(dataset, {.method = "tucker", .terms = 6, .polynomial = order})
            .summary.relative_l2;
    EXPECT_LT(error, before);
    before = error;
  }
  EXPECT_LT(before, 0.05);
}

TEST(Tucker, TheFileKeepsEveryBitRoundedOrNot) {
  const nacre::testing::TempFolder folder;
  const RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 10, .core = 7});
  for (const double bits : {0.0, 12.0, 32.0}) {
    const auto [m, summary] =
        Factor(dataset, {.method = "tucker", .terms = 4, .bits = bits});
    EXPECT_EQ(m.steps.empty(), summary.bits == 32);
    WriteMaterial(folder / "m.nacre.exr", m);
    EXPECT_EQ(std::filesystem::file_size(folder / "m.nacre.exr"),
              static_cast<std::uintmax_t>(summary.bytes));
    const Material read = ReadMaterial(folder / "m.nacre.exr");
    EXPECT_EQ(read.f, m.f);
    EXPECT_EQ(read.h, m.h);
    EXPECT_EQ(read.order, 3);
    std::vector<float> window(49);
    for (int c = 0; c < 3; ++c) {
      read.EvaluateWindow(c, 5, 6, window.data());
      for (int cell = 0; cell < 49; ++cell) {
        const float value = m.Evaluate(c, 5, 6, cell % 7, cell / 7);
        EXPECT_EQ(window[static_cast<std::size_t>(cell)], value);
        EXPECT_GE(value, 0);
      }
    }
  }
}

TEST(Tucker, AShiftThatIsNoCellIsRefused) {
  const nacre::testing::TempFolder folder;
  Material m =
      Factor(MakeTuckerData(), {.method = "tucker", .terms = 2, .bits = 32}).material;
  float& shift = m.f[static_cast<std::size_t>(TuckerShiftMap(m) * m.MapSize() + 3)];
  for (const float wrong : {49.0F, -1.0F, 0.5F}) {
    shift = wrong;
    EXPECT_THROW(WriteMaterial(folder / "m.nacre.exr", m), Error) << wrong;
  }
}

TEST(Tucker, ThreadCountsGiveTheSameBits) {
  const RdDataset dataset = MakeChessboard({.points_x = 30, .points_y = 20, .core = 9});
  const Material one =
      Factor(dataset, {.method = "tucker", .terms = 5, .thread_count = 1}).material;
  for (const int threads : {2, 3}) {
    const Material m =
        Factor(dataset, {.method = "tucker", .terms = 5, .thread_count = threads})
            .material;
    EXPECT_EQ(m.f, one.f);
    EXPECT_EQ(m.h, one.h);
    EXPECT_EQ(m.row_scale, one.row_scale);
  }
}

}  // namespace
}  // namespace nacre::factor::internal

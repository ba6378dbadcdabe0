// The block iteration against the eigenvectors of YᵀY.

#include "factor/internal/block_svd.h"

#include "core/random.h"
#include "factor/internal/log_svd.h"
#include "factor/internal/row_kernels.h"
#include "tests/factor/synthetic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace nacre::factor::internal {
namespace {

using nacre::testing::MakeChessboard;
using reconstruct::RdDataset;

TEST(RowKernels, LogarithmKeepsItsDigitsOverTwelveDecades) {
  const RowTransform transform{true, 0.02, 1};
  std::vector<float> rd;
  for (double value = 1e-12; value < 3; value *= 1.37) {
    rd.push_back(static_cast<float>(value));
    rd.push_back(static_cast<float>(-0.5 * std::min(value, 0.02)));
  }
  rd.push_back(0);
  const auto n = static_cast<std::int64_t>(rd.size());
  std::vector<float> s(static_cast<std::size_t>(PaddedColumns(n)), 7.0F);
  const float squares = TransformFloats(transform, rd, s.data());
  double sum = 0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    const double expected =
        k < rd.size() ? transform.Forward(static_cast<double>(rd[k])) : 0;
    EXPECT_NEAR(static_cast<double>(s[k]), expected, 5e-7 * std::abs(expected)) << k;
    sum += expected * expected;
  }
  EXPECT_NEAR(static_cast<double>(squares), sum, 1e-6 * sum);
}

TEST(RowKernels, ProductsEqualThoseInDouble) {
  constexpr std::int64_t kCount = 37;  // not a multiple of any tile
  constexpr std::int64_t kWidth = 48;
  RandomStream random(5, 0);
  const auto draw = [&] { return static_cast<float>(random.Uniform() - 0.5); };
  using Rows = Eigen::Matrix<float, -1, -1, Eigen::RowMajor>;
  const Rows y = Rows::NullaryExpr(kCount, kWidth, draw);
  const Rows v = Rows::NullaryExpr(kWidth, kPanel, draw);
  Rows u(kCount, kPanel);
  MultiplyPanel({y.data(), kCount, kWidth}, v.data(), u.data());
  EXPECT_LT((u.cast<double>() - y.cast<double>() * v.cast<double>()).norm(), 1e-5);
  RowMatrix z = RowMatrix::Ones(kWidth, kPanel);
  AddTransposedPanel({y.data(), kCount, kWidth}, u.data(), z.data());
  const RowMatrix expected = y.cast<double>().transpose() * u.cast<double>();
  EXPECT_LT((z - expected - RowMatrix::Ones(kWidth, kPanel)).norm(), 1e-4);
}

struct Fits {
  SvdModel blocks;
  SvdModel gram;
  RowMatrix y;  // of channel 0
};

SvdModel Start(SliceSource& source, const RowTransform& transform) {
  SvdModel model;
  model.scans = Scan(source, 0);
  model.transforms.assign(model.scans.size(), transform);
  model.cluster.assign(static_cast<std::size_t>(source.header().PointCount()), 0);
  return model;
}

Fits FitBoth(const RdDataset& data,
             const RowTransform& transform,
             const SvdFitOptions& options) {
  const auto source = SourceOf(data);
  Fits fits;
  fits.blocks = Start(*source, transform);
  fits.gram = fits.blocks;
  FitByBlocks(*source, options, fits.blocks, {});
  FitByGram(*source, options, fits.gram, {});
  fits.y.resize(data.header.PointCount(), data.header.WindowSize());
  for (Eigen::Index row = 0; row < fits.y.rows(); ++row) {
    for (Eigen::Index cell = 0; cell < fits.y.cols(); ++cell) {
      fits.y(row, cell) = transform.Forward(static_cast<double>(
          data.rd[static_cast<std::size_t>(row * data.header.SliceSize() + cell)]));
    }
  }
  return fits;
}

RowMatrix BlockModel(const Fits& fits) {
  const RowBasis& basis = fits.blocks.bases[0];
  const Eigen::Map<const Eigen::Matrix<float, -1, -1, Eigen::RowMajor>> scores(
      fits.blocks.scores[0].data(), fits.y.rows(), basis.rank());
  return scores.cast<double>() * basis.vectors.transpose();
}

RowMatrix GramModel(const Fits& fits) {
  const Eigen::MatrixXd& v = fits.gram.bases[0].vectors;
  return (fits.y * v) * v.transpose();
}

// The error of the blocks' model over that of the exact one, as a fraction of it; what
// floats can't hold is not counted.
void ExpectAsGood(const Fits& fits, double tolerance) {
  const double floor = 1e-6 * fits.y.norm();
  const double best = (fits.y - GramModel(fits)).norm();
  const double found = (fits.y - BlockModel(fits)).norm();
  EXPECT_LE(found, (1 + tolerance) * best + floor);
  EXPECT_LE(found, (1 + tolerance) * std::max(best, 3 * floor));
}

RdDataset Chessboard(double noise = 0, double scale = 1) {
  return MakeChessboard({.points_x = 96,
                         .points_y = 90,
                         .core = 11,
                         .channels = 1,
                         .noise = noise,
                         .scale = scale});
}

float Peak(const RdDataset& data) {
  return *std::max_element(data.rd.begin(), data.rd.end());
}

TEST(BlockSvd, ErrorIsTheExactOnesToTheTolerance) {
  const RdDataset data = Chessboard(1e-4);
  const double peak = static_cast<double>(Peak(data));
  for (const RowTransform& transform : {RowTransform{true, 0.01 * peak, 1},
                                        RowTransform{true, peak, 0.5},
                                        RowTransform{false, peak, 1},
                                        RowTransform{.a = peak, .is_root = true}}) {
    const Fits fits = FitBoth(data, transform, {.terms = 10});
    ASSERT_EQ(fits.blocks.bases[0].rank(), 10);
    ExpectAsGood(fits, 1e-5);
    EXPECT_LE(fits.blocks.excess, 1e-5);
  }
}

TEST(BlockSvd, ReconstructionIsTheExactOneWhereAskedFor) {
  const RdDataset data = Chessboard(1e-4);
  const RowTransform transform{true, 0.01 * static_cast<double>(Peak(data)), 1};
  const Fits fits = FitBoth(data, transform, {.terms = 10, .tolerance = 1e-10});
  const RowMatrix exact = GramModel(fits);
  EXPECT_LT((BlockModel(fits) - exact).norm(), 1e-5 * exact.norm());
  for (Eigen::Index j = 0; j < 10; ++j) {
    EXPECT_NEAR(fits.blocks.bases[0].sigma(j) / fits.gram.bases[0].sigma(j), 1, 1e-5);
  }
}

TEST(BlockSvd, MoreTermsThanAPanel) {
  const RdDataset data = Chessboard(1e-3);
  const RowTransform transform{true, 0.01 * static_cast<double>(Peak(data)), 1};
  const Fits fits = FitBoth(data, transform, {.terms = 24});
  ASSERT_EQ(fits.blocks.bases[0].rank(), 24);
  ExpectAsGood(fits, 5e-5);  // noise has no gap: the estimate is the first order of it
}

TEST(BlockSvd, UnitsDoNotMatter) {
  for (const double scale : {1e-30, 1e30}) {
    const RdDataset data = Chessboard(1e-4, scale);
    const double peak = static_cast<double>(Peak(data));
    ExpectAsGood(FitBoth(data, {true, 0.01 * peak, 1}, {.terms = 6}), 1e-5);
    ExpectAsGood(FitBoth(data, {false, peak, 1}, {.terms = 6}), 1e-5);
  }
}

TEST(BlockSvd, ARankThatIsSmallerIsFound) {
  RdDataset data = Chessboard();
  const auto window = static_cast<std::size_t>(data.header.WindowSize());
  const std::vector<float> rows(
      data.rd.begin(), data.rd.begin() + static_cast<std::ptrdiff_t>(3 * window));
  for (std::size_t n = 0; n < data.rd.size(); ++n) {  // three different rows
    data.rd[n] = rows[n / window % 3 * window + n % window];
  }
  const Fits fits = FitBoth(data, {false, 1, 1}, {.terms = 10});
  EXPECT_EQ(fits.blocks.bases[0].rank(), 3);
  EXPECT_LT((fits.y - BlockModel(fits)).norm(), 1e-6 * fits.y.norm());
}

TEST(BlockSvd, ConstantAndZero) {
  RdDataset data = Chessboard();
  std::fill(data.rd.begin(), data.rd.end(), 0.25F);
  const Fits constant = FitBoth(data, {true, 0.1, 1}, {.terms = 10});
  EXPECT_EQ(constant.blocks.bases[0].rank(), 1);
  EXPECT_LT((constant.y - BlockModel(constant)).norm(), 1e-6 * constant.y.norm());
  std::fill(data.rd.begin(), data.rd.end(), 0.0F);
  EXPECT_EQ(FitBoth(data, {true, 0.1, 1}, {.terms = 10}).blocks.bases[0].rank(), 0);
}

TEST(BlockSvd, TwelveDecadesOfRows) {
  RdDataset data = Chessboard(1e-4);
  for (std::size_t n = 0; n < data.rd.size(); ++n) {
    const auto row = static_cast<double>(
        n / static_cast<std::size_t>(data.header.WindowSize()) % 13);
    data.rd[n] *= static_cast<float>(std::pow(10, -row));
  }
  const double peak = static_cast<double>(Peak(data));
  ExpectAsGood(FitBoth(data, {false, peak, 1}, {.terms = 10}), 1e-5);
  ExpectAsGood(FitBoth(data, {true, 1e-3 * peak, 1}, {.terms = 10}), 1e-5);
}

// The tolerance, and 10⁻⁶ of the whole for floats. Singular values over twelve decades
// were off by 10⁻³ of it.
TEST(BlockSvd, WorstConditions) {
  const auto expect = [](const Fits& fits) {
    EXPECT_LE((fits.y - BlockModel(fits)).norm(),
              (1 + 1e-5) * (fits.y - GramModel(fits)).norm() + 1e-6 * fits.y.norm());
  };
  RdDataset data = Chessboard();
  const auto rows = static_cast<double>(data.header.PointCount());
  const auto window = static_cast<std::size_t>(data.header.WindowSize());
  for (const bool hilbert : {false, true}) {
    for (std::size_t n = 0; n < data.rd.size(); ++n) {
      const auto p = static_cast<double>(n / window);
      const auto d = static_cast<double>(n % window);
      double value = 1 / (0.01 * p + d + 1);
      for (int j = 0; j < 13 && !hilbert; ++j) {
        // Orthogonal rows and columns, singular values over twelve decades.
        value = (j == 0 ? 0 : value) +
                std::pow(10, -j) * std::cos(std::numbers::pi * j * (p + 0.5) / rows) *
                    std::cos(std::numbers::pi * j * (d + 0.5) / 121);
      }
      data.rd[n] = static_cast<float>(value);
    }
    for (const int terms : {4, 10}) {
      expect(FitBoth(data, {false, 1, 1}, {.terms = terms}));
      expect(FitBoth(data, {true, 3, 1}, {.terms = terms}));
      if (hilbert) {
        expect(FitBoth(data, {true, 1e-6, 1}, {.terms = terms}));
      }
    }
  }
}

TEST(BlockSvd, MissingHalvesAreCompletedAsByTheExactOne) {
  RdDataset data = Chessboard();
  const auto window = static_cast<std::size_t>(data.header.WindowSize());
  for (std::size_t n = 0; n < data.rd.size(); ++n) {
    if (n / window % 3 == 0 && n % window % 11 < 5) {
      data.valid[n] = 0;
      data.rd[n] = 9e9F;
    }
  }
  const RowTransform transform{true, 0.05, 1};
  const Fits fits = FitBoth(data, transform, {.terms = 5});
  EXPECT_EQ(fits.blocks.passes, 3);
  EXPECT_TRUE(fits.blocks.scores.empty());
  const Eigen::MatrixXd& v = fits.blocks.bases[0].vectors;
  const Eigen::MatrixXd& exact = fits.gram.bases[0].vectors;
  EXPECT_LT((v - exact * (exact.transpose() * v)).norm(), 0.02);
}

TEST(BlockSvd, SameBitsForAnyNumberOfThreads) {
  const RdDataset data = Chessboard(1e-3);
  const auto source = SourceOf(data);
  std::vector<SvdModel> models;
  for (const int threads : {1, 2, 3}) {
    models.push_back(Start(*source, {true, 0.05, 1}));
    FitByBlocks(*source, {.terms = 10, .thread_count = threads}, models.back(), {});
    EXPECT_EQ(models.back().scores, models.front().scores);
    EXPECT_EQ(models.back().bases[0].vectors, models.front().bases[0].vectors);
  }
}

}  // namespace
}  // namespace nacre::factor::internal

#include "factor/factor.h"

#include "core/error.h"
#include "reconstruct/error_figures.h"
#include "tests/factor/exact_svd.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::factor {
namespace {

using nacre::testing::MakeChessboard;
using nacre::testing::SyntheticOptions;
using nacre::testing::TempFolder;
using reconstruct::RdDataset;
using ::testing::AllOf;
using ::testing::HasSubstr;

RdDataset ToDataset(const Material& m, const reconstruct::RdHeader& header) {
  RdDataset dataset;
  dataset.header = header;
  dataset.rd.resize(static_cast<std::size_t>(header.PointCount() * header.SliceSize()));
  dataset.valid.assign(dataset.rd.size(), 1);
  dataset.sigma.assign(dataset.rd.size(), 0);
  float* window = dataset.rd.data();
  for (int j = 0; j < m.points_y; ++j) {
    for (int i = 0; i < m.points_x; ++i) {
      for (std::size_t c = 0; c < m.channels.size(); ++c) {
        m.EvaluateWindow(static_cast<int>(c), i, j, window);
        window += m.WindowSize();
      }
    }
  }
  return dataset;
}

void ExpectSameBits(const Material& a, const Material& b) {
  EXPECT_EQ(a.a, b.a);
  EXPECT_EQ(a.b, b.b);
  EXPECT_EQ(a.f, b.f);
  EXPECT_EQ(a.h, b.h);
  EXPECT_EQ(a.cluster, b.cluster);
  EXPECT_EQ(a.row_scale, b.row_scale);
  EXPECT_EQ(a.albedo, b.albedo);
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(a.error_curve, b.error_curve);
  EXPECT_EQ(a.provenance, b.provenance);
}

// The model is what it says: a singular value decomposition, per channel, of
// ln(R/A + B), cut after S terms; checked against Eigen's Jacobi SVD of the matrix.
TEST(Factor, IsTheTruncatedSvdOfTheTransformedRows) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 16, .points_y = 12, .core = 9, .noise = 1e-3});
  for (const char* method : {"log-svd", "svd"}) {
    const auto [m, summary] =
        Factor(dataset, {.method = method, .terms = 5, .bits = 32});
    ASSERT_EQ(m.terms, 5);
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      const bool is_log = m.transform == Transform::kLog;
      Eigen::MatrixXd y(192, 81);
      Eigen::MatrixXd model(192, 81);
      for (int p = 0; p < 192; ++p) {
        for (int d = 0; d < 81; ++d) {
          const auto rd =
              static_cast<double>(dataset.Window(p, c)[static_cast<std::size_t>(d)]);
          y(p, d) = is_log ? std::log(rd / m.a[channel] + m.b[channel]) : rd;
          model(p, d) = 0;
          for (int t = 0; t < 5; ++t) {
            model(p, d) += static_cast<double>(m.FactorMap(c, t)[p]) *
                           static_cast<double>(m.Kernel(c, 0, t)[d]);
          }
        }
      }
      const Eigen::MatrixXd oracle = nacre::testing::ComputeExactSvd(y).OfRank(5);
      EXPECT_LT((model - oracle).norm() / oracle.norm(), 1e-6) << method << c;
      // Terms come in order: maps of unit mean square, kernels with falling norm.
      for (int t = 0; t < 5; ++t) {
        double square = 0;
        for (int p = 0; p < 192; ++p) {
          square += static_cast<double>(m.FactorMap(c, t)[p] * m.FactorMap(c, t)[p]);
        }
        EXPECT_NEAR(square / 192, 1, 1e-5);
      }
    }
  }
}

TEST(Factor, TenTermsAddAtMostThreePercent) {
  for (const double noise : {0.0, 1e-3}) {
    const RdDataset dataset =
        MakeChessboard({.points_x = 40, .points_y = 40, .noise = noise, .seed = 21});
    const auto [m, summary] = Factor(dataset, {});
    EXPECT_LT(summary.relative_l2, 0.03) << noise;
    EXPECT_LT(summary.worst_total, 0.1 * summary.relative_l2);
  }
}

// The figures in the summary are those that `nacre compare` gives for the material.
TEST(Factor, SummaryAgreesWithTheComparison) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 14, .core = 9, .noise = 1e-3});
  const auto [m, summary] = Factor(dataset, {.terms = 3});
  const RdDataset model = ToDataset(m, dataset.header);
  const auto source = [](const RdDataset& d) {
    return reconstruct::SliceSource{
        d.header, [&d](int i, int j) {
          const std::int64_t size = d.header.SliceSize();
          const std::int64_t at = (std::int64_t{j} * d.header.points_x + i) * size;
          return reconstruct::RdSlice{
              {d.rd.begin() + at, d.rd.begin() + at + size},
              {d.sigma.begin() + at, d.sigma.begin() + at + size},
              {d.valid.begin() + at, d.valid.begin() + at + size}};
        }};
  };
  const reconstruct::ErrorFigures figures =
      reconstruct::CompareSlices(source(dataset), source(model));
  EXPECT_NEAR(summary.relative_l2, figures.relative_l2, 1e-9);
  EXPECT_NEAR(summary.rmse_over_mean, figures.rmse_over_mean, 1e-9);
  EXPECT_NEAR(summary.log_rms, figures.log_rms, 1e-9);
  EXPECT_NEAR(summary.psnr_db, figures.psnr_db, 1e-6);
  EXPECT_NEAR(summary.worst_slice, figures.worst_slice, 1e-9);
  EXPECT_EQ(summary.worst_slice_i, figures.worst_slice_i);
  EXPECT_EQ(summary.worst_slice_j, figures.worst_slice_j);
}

TEST(Factor, SliceTotalsAreExactAndNothingIsNegative) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 20, .core = 11, .noise = 3e-3});
  for (const char* method : {"log-svd", "svd"}) {
    const auto [m, summary] =
        Factor(dataset, {.method = method, .terms = 3, .bits = 32});
    std::vector<float> window(121);
    for (int p = 0; p < 400; ++p) {
      for (int c = 0; c < 3; ++c) {
        m.EvaluateWindow(c, p % 20, p / 20, window.data());
        double modelled = 0;
        double measured = 0;
        for (std::size_t d = 0; d < 121; ++d) {
          ASSERT_GE(window[d], 0);
          modelled += static_cast<double>(window[d]);
          measured += static_cast<double>(dataset.Window(p, c)[d]);
        }
        ASSERT_NEAR(modelled / measured, 1, 2e-6);
        ASSERT_NEAR(
            static_cast<double>(m.albedo[static_cast<std::size_t>(c * 400 + p)]),
            measured * dataset.header.CellAreaMm2(),
            1e-6);
      }
    }
  }
}

TEST(Factor, ThreadCountDoesNotChangeABit) {
  RdDataset dataset =
      MakeChessboard({.points_x = 40, .points_y = 30, .core = 11, .noise = 1e-3});
  for (std::size_t n = 0; n < dataset.valid.size(); n += 37) {
    dataset.valid[n] = 0;
  }
  for (const int clusters : {1, 3}) {
    FactorOptions options{
        .terms = 6, .clusters = clusters, .sample_rows = 64, .thread_count = 1};
    const Material one = Factor(dataset, options).material;
    for (const int threads : {2, 3}) {
      options.thread_count = threads;
      ExpectSameBits(one, Factor(dataset, options).material);
    }
  }
}

TEST(Factor, StreamingFromAFileIsTheSame) {
  const TempFolder folder;
  const RdDataset dataset =
      MakeChessboard({.points_x = 30, .points_y = 25, .core = 9, .channels = 2});
  reconstruct::WriteDataset(folder / "x.rd.exr", dataset);
  reconstruct::RdReader reader(folder / "x.rd.exr");
  ExpectSameBits(Factor(dataset, {.terms = 4}).material,
                 Factor(reader, {.terms = 4}).material);
}

TEST(Factor, ClustersLowerTheErrorAtEqualTerms) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 32, .points_y = 32, .channels = 1});
  const FactorSummary one = Factor(dataset, {.terms = 3}).summary;
  const auto [m, four] = Factor(dataset, {.terms = 3, .clusters = 4});
  EXPECT_EQ(four.clusters, 4);
  EXPECT_EQ(m.cluster_count, 4);
  EXPECT_LT(four.relative_l2, 0.9 * one.relative_l2);
}

TEST(Factor, MoreTermsNeverHurtTheCurveAndItsEndIsTheResult) {
  const RdDataset dataset = MakeChessboard({.points_x = 16, .points_y = 16});
  const auto [m, summary] = Factor(dataset, {.method = "svd", .terms = 8, .bits = 32});
  ASSERT_EQ(summary.error_curve.size(), 8u);
  for (std::size_t n = 1; n < 8; ++n) {
    EXPECT_LT(summary.error_curve[n].relative_l2,
              1.01 * summary.error_curve[n - 1].relative_l2);
  }
  // All 256 slices are in the sample of 256.
  EXPECT_NEAR(summary.error_curve[7].relative_l2, summary.relative_l2, 1e-6);
  EXPECT_NEAR(summary.error_curve[7].log_rms, summary.log_rms, 1e-5);
}

TEST(Factor, BytesAndErrorChooseTheTerms) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 24, .points_y = 24, .channels = 1});
  const FactorSummary full = Factor(dataset, {.terms = 12}).summary;
  const double budget = 0.5 * static_cast<double>(full.bytes);
  const FactorSummary small = Factor(dataset, {.terms = 12, .bytes = budget}).summary;
  EXPECT_LE(static_cast<double>(small.bytes), budget);
  const FactorSummary more = Factor(dataset, {.terms = small.terms + 1}).summary;
  EXPECT_GT(static_cast<double>(more.bytes), budget);
  const FactorSummary good = Factor(dataset, {.terms = 12, .error = 0.03}).summary;
  EXPECT_LE(good.relative_l2, 0.03);
  EXPECT_LT(good.terms, 12);
  const auto fewer = static_cast<std::size_t>(good.terms - 2);
  EXPECT_GT(full.error_curve[fewer].relative_l2, 0.03);
  const FactorSummary never = Factor(dataset, {.terms = 2, .error = 1e-6}).summary;
  EXPECT_THAT(never.notes, ::testing::Contains(HasSubstr("is not reached")));
}

TEST(Factor, LogWeightTradesRdErrorForTails) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 24, .points_y = 24, .core = 21, .channels = 1});
  const FactorSummary plain = Factor(dataset, {.terms = 4}).summary;
  const FactorSummary tails = Factor(dataset, {.terms = 4, .log_weight = 1}).summary;
  EXPECT_LT(tails.log_rms, plain.log_rms);
  EXPECT_GE(tails.relative_l2, 0.99 * plain.relative_l2);
}

TEST(Factor, UnknownMethodIsAUsageErrorThatListsTheOthers) {
  const RdDataset dataset = nacre::testing::MakeConstant(2, 2, 3, 1);
  try {
    Factor(dataset, {.method = "magic"});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(),
                AllOf(HasSubstr("magic"), HasSubstr("log-svd"), HasSubstr("svd")));
  }
}

TEST(Factor, OptionsOutOfRangeAreNamed) {
  const RdDataset dataset = nacre::testing::MakeConstant(2, 2, 3, 1);
  try {
    Factor(dataset, {.terms = -1});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(), HasSubstr("terms"));
  }
}

// Against each candidate by itself.
TEST(Factor, AutoTakesWhatIsBestAndSaysSo) {
  const RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 12, .core = 5});
  const FactorSummary reciprocal =
      Factor(dataset, {.method = "reciprocal", .sides = 1}).summary;
  const FactorSummary bilinear = Factor(dataset, {.method = "bilinear"}).summary;
  const FactorSummary log_svd = Factor(dataset, {.method = "log-svd"}).summary;
  EXPECT_EQ(reciprocal.terms, 4);
  EXPECT_EQ(bilinear.terms, 6);
  EXPECT_EQ(log_svd.terms, 10);
  const auto least =
      static_cast<double>(std::min({reciprocal.bytes, bilinear.bytes, log_svd.bytes}));
  const Factorization small = Factor(dataset, {.method = "auto", .bytes = least});
  EXPECT_LE(static_cast<double>(small.summary.bytes), least);
  const Factorization best = Factor(dataset, {.method = "auto"});
  for (const FactorSummary& s : {reciprocal, bilinear, log_svd}) {
    EXPECT_LE(best.summary.relative_l2 * best.summary.log_rms,
              1.000001 * s.relative_l2 * s.log_rms);
  }
  EXPECT_THAT(best.summary.notes.back(), HasSubstr(best.material.method));
}

// A dataset of one channel, three times over.
RdDataset MakeGrey(const RdDataset& one) {
  RdDataset grey = one;
  grey.header.channels = {"R", "G", "B"};
  grey.rd.clear();
  const std::int64_t window = one.header.WindowSize();
  for (auto slice = one.rd.begin(); slice != one.rd.end(); slice += window) {
    for (int c = 0; c < 3; ++c) {
      grey.rd.insert(grey.rd.end(), slice, slice + window);
    }
  }
  grey.valid.assign(grey.rd.size(), 1);
  return grey;
}

TEST(Factor, EqualChannelsAreFactoredAndStoredOnce) {
  RdDataset one =
      MakeChessboard({.points_x = 12, .points_y = 12, .core = 5, .channels = 1});
  one.sigma.clear();
  RdDataset grey = MakeGrey(one);
  const nacre::testing::TempFolder folder;
  for (const char* method : {"log-svd", "profiles", "bilinear", "reciprocal"}) {
    SCOPED_TRACE(method);
    const FactorOptions options{.method = method, .terms = 2};
    const auto [m, summary] = Factor(grey, options);
    const Factorization single = Factor(one, options);
    EXPECT_TRUE(m.is_grey);
    EXPECT_EQ(m.f, single.material.f);
    EXPECT_EQ(m.h, single.material.h);
    EXPECT_EQ(summary.dataset_bytes, 3 * single.summary.dataset_bytes);
    WriteMaterial(folder.path() / "m.nacre.exr", m);
    const Material read = ReadMaterial(folder.path() / "m.nacre.exr");
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(read.Evaluate(c, 3, 4, 1, 2), single.material.Evaluate(0, 3, 4, 1, 2));
    }
  }
  grey.rd[80] *= 1.001F;
  EXPECT_FALSE(Factor(grey, {.method = "svd"}).material.is_grey);
}

TEST(Factor, StopsWhenAsked) {
  const RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 12, .core = 5});
  try {
    Factor(dataset, {}, [](const Progress&) { return false; });
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kInterrupted);
  }
}

}  // namespace
}  // namespace nacre::factor

// The reciprocal model in the logarithm: what it promises, and that its fit finds it.

#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "factor/internal/reciprocal_taps.h"
#include "tests/factor/expect.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace nacre::factor {
namespace {

using nacre::testing::ExpectReciprocal;
using nacre::testing::MakeChessboard;
using nacre::testing::TempFolder;
using reconstruct::RdDataset;
using ::testing::HasSubstr;

FactorOptions Reciprocal(int terms, int taps = 3) {
  FactorOptions options;
  options.method = "reciprocal";
  options.terms = terms;
  options.taps = taps;
  return options;
}

double ErrorAgainst(const RdDataset& truth, const Material& m) {
  double error = 0;
  double signal = 0;
  const auto size = static_cast<std::size_t>(truth.header.WindowSize());
  std::vector<float> window(size);
  for (std::int64_t p = 0; p < truth.header.PointCount(); ++p) {
    for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
      m.EvaluateWindow(c,
                       static_cast<int>(p % m.points_x),
                       static_cast<int>(p / m.points_x),
                       window.data());
      for (std::size_t d = 0; d < size; ++d) {
        const auto value = static_cast<double>(truth.Window(p, c)[d]);
        error += std::pow(static_cast<double>(window[d]) - value, 2);
        signal += value * value;
      }
    }
  }
  return std::sqrt(error / signal);
}

TEST(Reciprocal, IsReciprocalToTheLastBitWhateverTheData) {
  for (const double noise : {0.0, 0.02}) {
    for (const int taps : {1, 4}) {
      const RdDataset dataset = MakeChessboard(
          {.points_x = 14, .points_y = 11, .core = 7, .noise = noise, .seed = 5});
      ExpectReciprocal(Factor(dataset, Reciprocal(3, taps)).material);
    }
  }
}

// Handmade maps and kernels: against the equation of the manual page.
TEST(Reciprocal, IsWhatItsEquationSays) {
  Material m = nacre::testing::MakeMaterial(4);
  m.form = Form::kReciprocal;
  m.transform = Transform::kLinear;
  m.cluster_count = 1;
  m.margin = 1;
  m.taps = 2;
  RandomStream random(3, 0);
  const auto size = static_cast<std::size_t>(m.KernelSize());
  ASSERT_EQ(size, 6U);
  m.f.resize(2 * 7 * 6);
  m.h.resize(3 * 8 * size);
  ASSERT_EQ(m.KernelCount(), 8);
  for (auto* values : {&m.f, &m.h}) {
    for (float& value : *values) {
      value = static_cast<float>(random.Uniform() - 0.4);
    }
  }
  for (std::size_t n = 0; n < m.h.size(); n += size) {
    m.h[n + 5] = m.h[n + 3];  // the middle row is its own mirror image
  }
  std::fill(m.cluster.begin(), m.cluster.end(), std::uint8_t{0});
  for (std::size_t n = 0; n < m.row_scale.size(); ++n) {
    m.row_scale[n] = 1 + 0.01F * static_cast<float>(n % 7);
  }
  Validate(m, "here");
  ExpectReciprocal(m);
  // Channel 1, from (1, 2) one to the right and one up: kernels at cell (2, 0).
  const auto f = [&](std::size_t term, std::size_t x, std::size_t y) {
    return static_cast<double>(m.f[term * 42 + (y + 1) * 7 + x + 1]);
  };
  const auto h = [&](std::size_t kernel) {
    return static_cast<double>(m.h[(8 + kernel) * size + 2]);
  };
  double s = h(0);
  for (std::size_t j = 0; j < 2; ++j) {
    const double ends = f(j, 1, 2) + f(j, 2, 1);
    const double middle = 0.25 * (ends + f(j, 2, 2) + f(j, 1, 1));
    s += h(1 + j) * ends + h(3 + j) * 2 * middle;
  }
  s += h(5) * 2 * f(0, 1, 2) * f(0, 2, 1) +
       h(6) * (f(0, 1, 2) * f(1, 2, 1) + f(1, 1, 2) * f(0, 2, 1)) +
       h(7) * 2 * f(1, 1, 2) * f(1, 2, 1);
  const auto points = static_cast<std::size_t>(m.PointCount());
  const auto row = static_cast<std::size_t>(m.points_x);
  const double scale = static_cast<double>(m.row_scale[points + 2 * row + 1]) *
                       static_cast<double>(m.row_scale[points + row + 2]);
  const double expected = m.a[1] * std::exp(s) * scale;
  EXPECT_NEAR(static_cast<double>(m.Evaluate(1, 1, 2, 2, 0)) / expected, 1, 1e-6);
}

TEST(Reciprocal, TapsTakeWhatLiesBetween) {
  for (const int du : {-5, 0, 1, 4}) {
    for (const int dv : {-2, 0, 3}) {
      std::vector<double> weight(4, 0.0);
      std::vector<double> x(4, 0.0);
      for (const auto& point : internal::TapPoints(du, dv, 4)) {
        const auto tap = static_cast<std::size_t>(point.tap);
        weight[tap] += static_cast<double>(point.weight);
        x[tap] += static_cast<double>(point.weight) * point.dx;
      }
      for (std::size_t tap = 1; tap < 4; ++tap) {
        EXPECT_EQ(weight[tap], 2);
        EXPECT_EQ(x[tap], du);  // 2 · du / 2
      }
    }
  }
}

// Data that are of the model to begin with come back.
TEST(Reciprocal, FindsItsOwnModelAgain) {
  RdDataset dataset = MakeChessboard({.points_x = 20, .points_y = 16, .core = 7});
  const auto g = [](double x, double y) {
    return std::sin(0.4 * x) + std::cos(0.3 * y);
  };
  std::size_t n = 0;
  for (std::int64_t slice = 0; slice < dataset.header.PointCount(); ++slice) {
    const auto i = static_cast<int>(slice % dataset.header.points_x);
    const auto j = static_cast<int>(slice / dataset.header.points_x);
    for (int c = 0; c < 3; ++c) {
      for (int v = -3; v <= 3; ++v) {
        for (int u = -3; u <= 3; ++u) {
          const double r = std::hypot(u, v);
          const double here = g(i, j);
          const double there = g(i + u, j + v);
          dataset.rd[n++] = static_cast<float>(std::exp(
              -r - (0.1 + 0.02 * c * r) * (here + there) + 0.05 * here * there));
        }
      }
    }
  }
  const FactorSummary summary = Factor(dataset, Reciprocal(1)).summary;
  EXPECT_LT(summary.relative_l2, 0.006);
  EXPECT_LT(summary.log_rms, 0.015);
}

TEST(Reciprocal, IsBetterAndSmallerThanTheThesisModel) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 24, .points_y = 24, .core = 9, .noise = 1e-3});
  const RdDataset truth = MakeChessboard({.points_x = 24, .points_y = 24, .core = 9});
  const auto reciprocal = Factor(dataset, Reciprocal(2));
  const auto other = Factor(dataset, {.method = "log-svd", .terms = 10});
  EXPECT_LT(reciprocal.summary.bytes, other.summary.bytes);
  EXPECT_LT(reciprocal.summary.log_rms, other.summary.log_rms);
  EXPECT_LT(ErrorAgainst(truth, reciprocal.material), 0.02);
}

TEST(Reciprocal, WhatWasNotMeasuredDoesNotCount) {
  const RdDataset whole = MakeChessboard({.points_x = 16, .points_y = 16, .core = 7});
  RdDataset holed = whole;
  RandomStream random(11, 0);
  for (std::size_t n = 0; n < holed.rd.size(); ++n) {
    if (random.Uniform() < 0.3) {
      holed.valid[n] = 0;
      holed.rd[n] = 1e3F;  // must not be looked at
    }
  }
  EXPECT_LT(ErrorAgainst(whole, Factor(holed, Reciprocal(3)).material), 0.02);
}

// Half of the pairs are off by a lot, and say so.
TEST(Reciprocal, WeighsBySigma) {
  const RdDataset truth = MakeChessboard({.points_x = 16, .points_y = 16, .core = 7});
  RdDataset noisy = truth;
  RandomStream random(5, 0);
  for (std::size_t n = 0; n < noisy.rd.size(); ++n) {
    const bool is_bad = random.Uniform() < 0.3;
    const double sigma = is_bad ? 0.05 : 1e-5;
    noisy.rd[n] += static_cast<float>(sigma * 2 * (random.Uniform() - 0.5));
    noisy.sigma[n] = static_cast<float>(sigma);
  }
  RdDataset untold = noisy;
  std::fill(untold.sigma.begin(), untold.sigma.end(), 1e-5F);
  const double told = ErrorAgainst(truth, Factor(noisy, Reciprocal(2)).material);
  EXPECT_LT(told, 0.7 * ErrorAgainst(truth, Factor(untold, Reciprocal(2)).material));
}

TEST(Reciprocal, TotalsStayWithinTheBound) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 18, .core = 9, .noise = 2e-3});
  FactorOptions options = Reciprocal(1);
  options.totals = 1;
  EXPECT_GT(Factor(dataset, options).summary.worst_total, 0.005);
  for (const double bound : {0.005, 0.003}) {
    options.totals = bound;
    const auto [m, summary] = Factor(dataset, options);
    EXPECT_LE(summary.worst_total, bound);
    ExpectReciprocal(m);
  }
}

TEST(Reciprocal, LittleMemoryTakesFewerPairs) {
  const RdDataset dataset = MakeChessboard({.points_x = 24, .points_y = 24, .core = 9});
  FactorOptions options = Reciprocal(2);
  const auto all = Factor(dataset, options).summary;
  options.memory_mb = 1;
  const auto some = Factor(dataset, options).summary;
  EXPECT_THAT(some.notes, ::testing::Contains(HasSubstr("as memory allows")));
  EXPECT_LT(some.relative_l2, 1.3 * all.relative_l2);
  EXPECT_LT(some.log_rms, 2 * all.log_rms);
}

// Large data: chosen by a sample and read once, or by all slices.
TEST(Reciprocal, OneReadingIsAsGoodAsMany) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 92, .points_y = 90, .core = 7, .channels = 1});
  FactorOptions options = Reciprocal(2);
  const auto once = Factor(dataset, options);
  options.check_slices = 0;
  const auto many = Factor(dataset, options);
  EXPECT_LT(once.summary.passes, many.summary.passes);
  EXPECT_EQ(once.summary.measured_slices, 4096);
  EXPECT_EQ(many.summary.measured_slices, 92 * 90);
  // What is said of some slices is so of all.
  const double error = ErrorAgainst(dataset, once.material);
  EXPECT_NEAR(once.summary.relative_l2 / error, 1, 0.05);
  EXPECT_NEAR(many.summary.relative_l2 / ErrorAgainst(dataset, many.material), 1, 1e-3);
  // They begin with other maps, and so needn't end at the same.
  EXPECT_LT(error, 1.1 * many.summary.relative_l2);
  EXPECT_LT(once.summary.log_rms, 1.1 * many.summary.log_rms);
}

// The terms of the model are searched, what is left goes to the rest.
TEST(Reciprocal, BytesAndErrorAreKeptWithARest) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 16, .points_y = 16, .core = 7, .channels = 1});
  FactorOptions options = Reciprocal(3);
  options.rest = 4;
  const auto full = Factor(dataset, options).summary;
  EXPECT_EQ(full.terms, 3);
  options.bytes = 0.85 * static_cast<double>(full.bytes);
  const auto small = Factor(dataset, options);
  EXPECT_LE(static_cast<double>(small.summary.bytes), options.bytes);
  EXPECT_LT(small.summary.terms, 3);
  EXPECT_EQ(FileBytes(small.material), small.summary.bytes);
  options.bytes = 0;
  options.error = 1.001 * small.summary.relative_l2;
  const auto good = Factor(dataset, options).summary;
  EXPECT_LE(good.relative_l2, options.error);
  EXPECT_LE(good.terms, 3);
  options.error = 1e-7;
  const auto never = Factor(dataset, options).summary;
  EXPECT_THAT(never.notes, ::testing::Contains(HasSubstr("is not reached")));
  EXPECT_EQ(never.terms, full.terms);
}

TEST(Reciprocal, ThreadCountDoesNotChangeABit) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 16, .core = 9, .noise = 1e-3});
  FactorOptions options = Reciprocal(3);
  options.thread_count = 1;
  const Material one = Factor(dataset, options).material;
  for (const int threads : {2, 3}) {
    options.thread_count = threads;
    const Material more = Factor(dataset, options).material;
    EXPECT_EQ(one.f, more.f);
    EXPECT_EQ(one.h, more.h);
    EXPECT_EQ(one.row_scale, more.row_scale);
    EXPECT_EQ(one.error, more.error);
  }
}

TEST(Reciprocal, ComesBackFromItsFile) {
  const TempFolder folder;
  const RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 9, .core = 5});
  for (const double bits : {0.0, 32.0}) {
    FactorOptions options = Reciprocal(2);
    options.bits = bits;
    const Material m = Factor(dataset, options).material;
    WriteMaterial(folder / "m.nacre.exr", m);
    const Material read = ReadMaterial(folder / "m.nacre.exr");
    EXPECT_EQ(read.form, Form::kReciprocal);
    EXPECT_EQ(read.taps, 3);
    EXPECT_EQ(read.margin, 2);
    EXPECT_EQ(read.a, m.a);
    EXPECT_EQ(read.f, m.f);
    EXPECT_EQ(read.h, m.h);
    EXPECT_EQ(read.row_scale, m.row_scale);
    EXPECT_EQ(read.albedo, m.albedo);
    EXPECT_EQ(read.steps, m.steps);
  }
}

TEST(Reciprocal, HasNoClusters) {
  const RdDataset dataset = nacre::testing::MakeConstant(4, 4, 3, 1);
  FactorOptions options = Reciprocal(2);
  options.clusters = 2;
  try {
    Factor(dataset, options);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(), HasSubstr("clusters"));
  }
}

}  // namespace
}  // namespace nacre::factor

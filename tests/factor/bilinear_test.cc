// The reciprocal bilinear model: what it promises, and that its fit finds it.

#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
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

FactorOptions Bilinear(int terms) {
  return {.method = "bilinear", .terms = terms};
}

TEST(Bilinear, IsReciprocalToTheLastBitWhateverTheData) {
  for (const double noise : {0.0, 0.02}) {
    const RdDataset dataset = MakeChessboard(
        {.points_x = 14, .points_y = 11, .core = 7, .noise = noise, .seed = 5});
    ExpectReciprocal(Factor(dataset, Bilinear(4)).material);
  }
}

// Handmade kernels without any symmetry: the model itself is reciprocal, not the fit.
TEST(Bilinear, IsReciprocalWhateverItHolds) {
  Material m = nacre::testing::MakeMaterial(4);
  m.form = Form::kBilinear;
  m.transform = Transform::kLinear;
  m.cluster_count = 1;
  m.margin = 1;
  RandomStream random(3, 0);
  m.f.resize(2 * 7 * 6);
  m.h.resize(3 * 3 * 9);
  for (auto* values : {&m.f, &m.h}) {
    for (float& value : *values) {
      value = static_cast<float>(random.Uniform() - 0.4);
    }
  }
  std::fill(m.row_scale.begin(), m.row_scale.end(), 1.0F);
  std::fill(m.cluster.begin(), m.cluster.end(), std::uint8_t{0});
  Validate(m, "here");
  ExpectReciprocal(m);
  // By hand: channel 1, from (1, 2) one to the right and one up.
  const auto f = [&](std::size_t term, std::size_t x, std::size_t y) {
    return static_cast<double>(m.f[term * 42 + (y + 1) * 7 + x + 1]);
  };
  const auto h = [&](std::size_t pair, std::size_t cell) {
    return static_cast<double>(m.h[(3 + pair) * 9 + cell]);
  };
  const double expected =
      h(0, 2) * f(0, 1, 2) * f(0, 2, 1) + h(1, 2) * f(0, 1, 2) * f(1, 2, 1) +
      h(1, 6) * f(1, 1, 2) * f(0, 2, 1) + h(2, 2) * f(1, 1, 2) * f(1, 2, 1);
  EXPECT_NEAR(
      static_cast<double>(m.Evaluate(1, 1, 2, 2, 0)), std::max(0.0, expected), 1e-6);
}

// Data that are bilinear to begin with come back.
TEST(Bilinear, FindsABilinearModelAgain) {
  RdDataset dataset = MakeChessboard({.points_x = 30, .points_y = 24, .core = 7});
  const reconstruct::RdHeader& header = dataset.header;
  std::size_t n = 0;
  for (std::int64_t slice = 0; slice < header.PointCount(); ++slice) {
    const auto i = static_cast<int>(slice % header.points_x);
    const auto j = static_cast<int>(slice / header.points_x);
    for (int c = 0; c < 3; ++c) {
      for (int v = 0; v < 7; ++v) {
        for (int u = 0; u < 7; ++u) {
          const auto g = [](int x, int y) {
            return std::sin(0.4 * x) * std::cos(0.3 * y);
          };
          const double here = g(i, j);
          const double there = g(i + u - 3, j + v - 3);
          const double r2 = (u - 3) * (u - 3) + (v - 3) * (v - 3);
          dataset.rd[n++] = static_cast<float>(
              std::exp(-0.3 * r2) + 0.1 * std::exp(-0.3 * r2) * (here + there) +
              0.2 * (c + 1) * std::exp(-0.4 * r2) * here * there);
        }
      }
    }
  }
  const FactorSummary one = Factor(dataset, Bilinear(1)).summary;
  const FactorSummary two = Factor(dataset, Bilinear(2)).summary;
  EXPECT_LT(two.relative_l2, 0.01);
  EXPECT_LT(two.log_rms, 0.02);
  EXPECT_GT(one.relative_l2, 5 * two.relative_l2);
}

TEST(Bilinear, HasLessErrorThanSvdOfTheSameSize) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 32, .points_y = 32, .core = 11, .noise = 1e-3});
  const auto svd = Factor(dataset, {.method = "svd", .terms = 10}).summary;
  const auto bilinear = Factor(dataset,
                               {.method = "bilinear",
                                .terms = 6,
                                .bytes = static_cast<double>(svd.bytes),
                                .tail_weight = 0})
                            .summary;
  EXPECT_LE(bilinear.bytes, svd.bytes);
  EXPECT_LT(bilinear.relative_l2, svd.relative_l2);
}

TEST(Bilinear, WhatWasNotMeasuredDoesNotCount) {
  const RdDataset whole = MakeChessboard({.points_x = 24, .points_y = 24, .core = 9});
  RdDataset holed = whole;
  RandomStream random(11, 0);
  for (std::size_t n = 0; n < holed.rd.size(); ++n) {
    if (random.Uniform() < 0.3) {
      holed.valid[n] = 0;
      holed.rd[n] = 1e3F;  // must not be looked at
    }
  }
  const Material m = Factor(holed, Bilinear(5)).material;
  double error = 0;
  double signal = 0;
  std::vector<float> window(81);
  for (std::int64_t p = 0; p < 576; ++p) {
    for (int c = 0; c < 3; ++c) {
      m.EvaluateWindow(
          c, static_cast<int>(p % 24), static_cast<int>(p / 24), window.data());
      for (std::size_t d = 0; d < 81; ++d) {
        const auto truth = static_cast<double>(whole.Window(p, c)[d]);
        error += std::pow(static_cast<double>(window[d]) - truth, 2);
        signal += truth * truth;
      }
    }
  }
  EXPECT_LT(std::sqrt(error / signal), 0.02);
}

TEST(Bilinear, ThreadCountDoesNotChangeABit) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 16, .core = 9, .noise = 1e-3});
  FactorOptions options = Bilinear(4);
  options.thread_count = 1;
  const Material one = Factor(dataset, options).material;
  for (const int threads : {2, 3}) {
    options.thread_count = threads;
    const Material more = Factor(dataset, options).material;
    EXPECT_EQ(one.f, more.f);
    EXPECT_EQ(one.h, more.h);
    EXPECT_EQ(one.error, more.error);
  }
}

TEST(Bilinear, ComesBackFromItsFile) {
  const TempFolder folder;
  const RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 9, .core = 5});
  for (const double bits : {0.0, 32.0}) {
    FactorOptions options = Bilinear(3);
    options.bits = bits;
    const Material m = Factor(dataset, options).material;
    WriteMaterial(folder / "m.nacre.exr", m);
    const Material read = ReadMaterial(folder / "m.nacre.exr");
    EXPECT_EQ(read.form, Form::kBilinear);
    EXPECT_EQ(read.margin, 2);
    EXPECT_EQ(read.f, m.f);
    EXPECT_EQ(read.h, m.h);
    EXPECT_EQ(read.albedo, m.albedo);
    EXPECT_EQ(read.steps, m.steps);
  }
}

TEST(Bilinear, HasNoClusters) {
  const RdDataset dataset = nacre::testing::MakeConstant(4, 4, 3, 1);
  FactorOptions options = Bilinear(2);
  options.clusters = 2;
  try {
    Factor(dataset, options);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(), HasSubstr("clusters"));
  }
}

TEST(Bilinear, SaysHowMuchMemoryItNeeds) {
  const RdDataset dataset = MakeChessboard({.points_x = 24, .points_y = 24});
  const FactorOptions options{.method = "bilinear", .terms = 1, .memory_mb = 1};
  try {
    Factor(dataset, options);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("memory_mb allows 1;"));
    EXPECT_THAT(e.what(), ::testing::HasSubstr("reciprocal"));
  }
}

}  // namespace
}  // namespace nacre::factor

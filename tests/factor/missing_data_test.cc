// Values that weren't measured take no part, and the model predicts them.

#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "tests/factor/synthetic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace nacre::factor {
namespace {

using nacre::testing::MakeChessboard;
using reconstruct::RdDataset;
using ::testing::HasSubstr;

// Invalid values are made absurd: whoever uses one shows it.
void Remove(RdDataset& dataset, std::size_t n) {
  dataset.valid[n] = 0;
  dataset.rd[n] = -1e6F;
}

double ErrorAgainst(const Material& m, const RdDataset& truth) {
  std::vector<float> window(static_cast<std::size_t>(m.WindowSize()));
  double error = 0;
  double signal = 0;
  for (int p = 0; p < m.PointCount(); ++p) {
    for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
      m.EvaluateWindow(c, p % m.points_x, p / m.points_x, window.data());
      for (std::size_t d = 0; d < window.size(); ++d) {
        const auto wanted = static_cast<double>(truth.Window(p, c)[d]);
        error += std::pow(static_cast<double>(window[d]) - wanted, 2);
        signal += wanted * wanted;
      }
    }
  }
  return std::sqrt(error / signal);
}

TEST(MissingData, ScatteredGapsCostLittle) {
  const RdDataset truth =
      MakeChessboard({.points_x = 24, .points_y = 24, .channels = 1});
  RdDataset holed = truth;
  RandomStream random(4, 0);
  for (std::size_t n = 0; n < holed.rd.size(); ++n) {
    if (random.Uniform() < 0.15) {
      Remove(holed, n);
    }
  }
  for (const char* method : {"log-svd", "svd"}) {
    const FactorOptions options{.method = method, .terms = 6};
    const double whole = ErrorAgainst(Factor(truth, options).material, truth);
    const auto [m, summary] = Factor(holed, options);
    EXPECT_NEAR(summary.missing_fraction, 0.15, 0.01);
    EXPECT_LT(ErrorAgainst(m, truth), 1.6 * whole) << method;
  }
}

TEST(MissingData, RoundsOfPredictionHelp) {
  const RdDataset truth =
      MakeChessboard({.points_x = 24, .points_y = 24, .channels = 1});
  RdDataset holed = truth;
  RandomStream random(5, 0);
  for (std::size_t n = 0; n < holed.rd.size(); ++n) {
    if (random.Uniform() < 0.3) {
      Remove(holed, n);
    }
  }
  FactorOptions options{.method = "svd", .terms = 6, .fill_rounds = 0};
  const double once = ErrorAgainst(Factor(holed, options).material, truth);
  options.fill_rounds = 3;
  EXPECT_LT(ErrorAgainst(Factor(holed, options).material, truth), 0.97 * once);
}

// Windows at the edge of the field of view: half of them is outside the picture.
TEST(MissingData, MaskedHalvesAreNotTakenForZeros) {
  const RdDataset truth =
      MakeChessboard({.points_x = 24, .points_y = 24, .channels = 1});
  RdDataset holed = truth;
  for (std::size_t p = 0; p < 24 * 24; ++p) {
    if (p % 24 >= 12) {
      continue;
    }
    for (std::size_t d = 0; d < 225; ++d) {
      if (d % 15 < 7) {
        Remove(holed, p * 225 + d);
      }
    }
  }
  const auto [m, summary] = Factor(holed, {.terms = 5});
  EXPECT_LT(summary.relative_l2, 0.05);
  EXPECT_LT(ErrorAgainst(m, truth), 0.15);
}

TEST(MissingData, ASliceLostIsPredictedFromTheOthers) {
  const RdDataset truth =
      MakeChessboard({.points_x = 12, .points_y = 12, .channels = 1});
  RdDataset holed = truth;
  for (std::size_t d = 0; d < 225; ++d) {
    Remove(holed, 50 * 225 + d);
  }
  const Material m = Factor(holed, {.terms = 4}).material;
  EXPECT_GT(m.Evaluate(0, 50 % 12, 50 / 12, 7, 7), 0.3F * truth.Window(50, 0)[112]);
  EXPECT_LT(m.Evaluate(0, 50 % 12, 50 / 12, 7, 7), 3.0F * truth.Window(50, 0)[112]);
}

TEST(MissingData, ACellNeverMeasuredTakesItsRing) {
  const RdDataset truth =
      MakeChessboard({.points_x = 12, .points_y = 12, .channels = 1});
  RdDataset holed = truth;
  for (std::size_t p = 0; p < 144; ++p) {
    Remove(holed, p * 225 + 7 * 15 + 9);
  }
  const Material m = Factor(holed, {.terms = 4}).material;
  const float wanted = truth.Window(30, 0)[7 * 15 + 9];
  EXPECT_NEAR(m.Evaluate(0, 30 % 12, 30 / 12, 9, 7) / wanted, 1, 0.4);
}

TEST(MissingData, AChannelWithoutAnyMeasurementIsRefused) {
  RdDataset dataset = MakeChessboard({.points_x = 3, .points_y = 3, .core = 3});
  for (std::size_t p = 0; p < 9; ++p) {
    for (std::size_t d = 0; d < 9; ++d) {
      dataset.valid[p * 27 + 9 + d] = 0;
    }
  }
  try {
    Factor(dataset, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), HasSubstr("channel G"));
  }
}

}  // namespace
}  // namespace nacre::factor

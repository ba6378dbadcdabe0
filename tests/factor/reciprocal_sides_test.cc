// What the reciprocal model stores beside maps at points: sides, which tell the two
// directions apart (light enters at a point and leaves from a cell), and the rest,
// which tells pairs apart whose points are alike.

#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "reconstruct/error_figures.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace nacre::factor {
namespace {

using nacre::testing::MakeChessboard;
using nacre::testing::TempFolder;
using reconstruct::RdDataset;

FactorOptions Options(int sides) {
  FactorOptions options;
  options.method = "reciprocal";
  options.terms = 3;
  options.sides = sides;
  options.totals = 1;
  return options;
}

// A reciprocal dataset (what a model without sides makes of a chessboard), and the same
// with what enters at a point times a factor of it.
struct Pair {
  RdDataset symmetric;
  RdDataset sided;
};

Pair MakePair() {
  Pair pair;
  pair.symmetric = MakeChessboard({.points_x = 20, .points_y = 18, .core = 7});
  const Material m = Factor(pair.symmetric, Options(0)).material;
  const auto size = static_cast<std::size_t>(m.WindowSize());
  const auto channels = m.channels.size();
  for (std::int64_t p = 0; p < m.PointCount(); ++p) {
    for (std::size_t c = 0; c < channels; ++c) {
      m.EvaluateWindow(
          static_cast<int>(c),
          static_cast<int>(p % m.points_x),
          static_cast<int>(p / m.points_x),
          &pair.symmetric.rd[(static_cast<std::size_t>(p) * channels + c) * size]);
    }
  }
  pair.sided = pair.symmetric;
  RandomStream random(9, 0);
  std::vector<double> side;
  for (std::int64_t p = 0; p < m.PointCount(); ++p) {
    side.push_back(0.2 * (random.Uniform() - 0.5));
  }
  const int radius = (m.core - 1) / 2;
  for (std::size_t n = 0; n < pair.sided.rd.size(); ++n) {
    const auto point = static_cast<int>(n / (size * channels));
    const auto cell = static_cast<int>(n % size);
    const int x = point % m.points_x + cell % m.core - radius;
    const int y = point / m.points_x + cell / m.core - radius;
    if (x >= 0 && y >= 0 && x < m.points_x && y < m.points_y) {
      pair.sided.rd[n] *= static_cast<float>(
          std::exp(side[static_cast<std::size_t>(point)] -
                   side[static_cast<std::size_t>(y * m.points_x + x)]));
    }
  }
  return pair;
}

double ErrorOf(const RdDataset& dataset, const Material& m) {
  double error = 0;
  double signal = 0;
  const auto size = static_cast<std::size_t>(m.WindowSize());
  std::vector<float> window(size);
  for (std::size_t n = 0; n < dataset.rd.size(); n += size) {
    const auto point = static_cast<int>(n / (size * m.channels.size()));
    m.EvaluateWindow(static_cast<int>(n / size % m.channels.size()),
                     point % m.points_x,
                     point / m.points_x,
                     window.data());
    for (std::size_t d = 0; d < size; ++d) {
      const auto value = static_cast<double>(dataset.rd[n + d]);
      error += std::pow(static_cast<double>(window[d]) - value, 2);
      signal += value * value;
    }
  }
  return std::sqrt(error / signal);
}

void ExpectSameBothWays(const Material& m) {
  const int radius = (m.core - 1) / 2;
  for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
    for (int j = 0; j < m.points_y; ++j) {
      for (int i = 0; i < m.points_x; ++i) {
        for (int n = 0; n < m.WindowSize(); ++n) {
          const int u = n % m.core;
          const int v = n / m.core;
          const int x = i + u - radius;
          const int y = j + v - radius;
          if (x >= 0 && y >= 0 && x < m.points_x && y < m.points_y) {
            ASSERT_EQ(m.Evaluate(c, i, j, u, v),
                      m.Evaluate(c, x, y, m.core - 1 - u, m.core - 1 - v));
          }
        }
      }
    }
  }
}

TEST(ReciprocalSides, WhatDiffersBetweenTheTwoWaysIsFoundAndLeavesRdReciprocal) {
  const Pair pair = MakePair();
  const double without = ErrorOf(pair.sided, Factor(pair.sided, Options(0)).material);
  const auto [m, summary] = Factor(pair.sided, Options(1));
  ASSERT_EQ(m.sides, 1);
  EXPECT_LT(ErrorOf(pair.sided, m), 0.3 * without);
  const Material symmetric = WithoutSides(m);
  Validate(symmetric, "without sides");
  ExpectSameBothWays(symmetric);
  EXPECT_LT(ErrorOf(pair.symmetric, symmetric), 0.3 * without);
}

TEST(ReciprocalSides, NoMapWhereBothWaysAreTheSame) {
  const auto [m, summary] = Factor(MakePair().symmetric, Options(1));
  EXPECT_EQ(m.sides, 0);
  ASSERT_FALSE(summary.notes.empty());
  ExpectSameBothWays(m);
}

TEST(ReciprocalSides, AFileKeepsThem) {
  const auto [m, summary] = Factor(MakePair().sided, Options(1));
  const TempFolder folder;
  WriteMaterial(folder.path() / "m.nacre.exr", m);
  const Material read = ReadMaterial(folder.path() / "m.nacre.exr");
  EXPECT_EQ(read.sides, 1);
  EXPECT_EQ(read.f, m.f);
  EXPECT_EQ(read.h, m.h);
  EXPECT_EQ(read.Evaluate(1, 4, 5, 2, 6), m.Evaluate(1, 4, 5, 2, 6));
}

TEST(ReciprocalSides, OnlyTheReciprocalFormHasThem) {
  Material m = nacre::testing::MakeMaterial(4);
  m.sides = 1;
  EXPECT_THROW(Validate(m, "a material"), Error);
  m.sides = 0;
  m.rest = 1;
  EXPECT_THROW(Validate(m, "a material"), Error);
}

// A reciprocal dataset in which what goes between neighbours side by side is changed by
// something that neither of them knows of.
RdDataset WithSomethingBetween() {
  RdDataset dataset = MakePair().symmetric;
  const reconstruct::RdHeader& h = dataset.header;
  RandomStream random(11, 0);
  std::vector<float> between;
  for (std::int64_t p = 0; p < h.PointCount(); ++p) {
    between.push_back(static_cast<float>(std::exp(3 * (random.Uniform() - 0.5))));
  }
  const std::int64_t middle = h.WindowSize() / 2;
  for (std::int64_t n = 0; n < std::ssize(dataset.rd); ++n) {
    const std::int64_t point = n / h.SliceSize();
    const std::int64_t cell = n % h.WindowSize();
    const std::int64_t first = cell == middle - 1 ? point : point + 1;
    if ((cell == middle - 1 && point % h.points_x > 0) ||
        (cell == middle + 1 && first % h.points_x > 0)) {
      dataset.rd[static_cast<std::size_t>(n)] *=
          between[static_cast<std::size_t>(first)];
    }
  }
  return dataset;
}

TEST(ReciprocalRest, WhatIsBetweenPointsIsFoundAndTheSameBothWays) {
  const RdDataset dataset = WithSomethingBetween();
  FactorOptions options = Options(0);
  options.bits = 32;
  const double without = ErrorOf(dataset, Factor(dataset, options).material);
  options.rest = 2;
  const Material m = Factor(dataset, options).material;
  ASSERT_GE(m.rest, 1);
  EXPECT_LT(ErrorOf(dataset, m), 0.2 * without);
  ExpectSameBothWays(m);
  std::vector<float> window(static_cast<std::size_t>(m.WindowSize()));
  m.EvaluateWindow(1, 7, 8, window.data());
  for (std::size_t n = 0; n < window.size(); ++n) {
    EXPECT_GT(window[n], 0);
    EXPECT_EQ(window[n],
              m.Evaluate(
                  1, 7, 8, static_cast<int>(n) % m.core, static_cast<int>(n) / m.core));
  }
  const TempFolder folder;
  WriteMaterial(folder.path() / "m.nacre.exr", m);
  const Material read = ReadMaterial(folder.path() / "m.nacre.exr");
  EXPECT_EQ(read.rest, m.rest);
  EXPECT_EQ(read.f, m.f);
  EXPECT_EQ(read.h, m.h);
  options.thread_count = 1;
  EXPECT_EQ(Factor(dataset, options).material.f, m.f);
}

TEST(ReciprocalRest, NoiseAloneIsNotKept) {
  RdDataset dataset = MakePair().symmetric;
  RandomStream random(12, 0);
  const float peak = *std::max_element(dataset.rd.begin(), dataset.rd.end());
  dataset.sigma.resize(dataset.rd.size());
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    const float sigma = 0.02F * std::sqrt(dataset.rd[n] * peak);
    dataset.sigma[n] = sigma;
    // Uniform, of variance 1.
    dataset.rd[n] +=
        sigma * static_cast<float>(std::sqrt(12.0) * (random.Uniform() - 0.5));
  }
  FactorOptions options = Options(0);
  options.rest = 12;
  EXPECT_LE(Factor(dataset, options).material.rest, 1);
}

}  // namespace
}  // namespace nacre::factor

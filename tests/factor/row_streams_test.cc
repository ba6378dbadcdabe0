#include "factor/internal/row_streams.h"

#include "core/random.h"
#include "factor/internal/reciprocal_sums.h"
#include "factor/material.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace nacre::factor::internal {
namespace {

std::vector<float> Draws(RandomStream& random, std::size_t count) {
  std::vector<float> values(count);
  for (float& value : values) {
    value = static_cast<float>(random.Uniform() - 0.5);
  }
  return values;
}

// All lengths of vectors, their ends and what is left of them.
TEST(RowStreams, AddUpWhatPlainLoopsDo) {
  RandomStream random(3, 0);
  for (std::size_t n = 0; n < 150; n += n < 40 ? 1 : 13) {
    const std::vector<float> a = Draws(random, n);
    const std::vector<float> b = Draws(random, n);
    const std::vector<float> c = Draws(random, n);
    const float* rows[] = {a.data(), b.data(), c.data()};
    const float weights[] = {0.5F, -2, 3};
    std::vector<float> sum(n + 1, 7);
    LinearCombination(rows, weights, 3, 1, n, sum.data());
    std::vector<float> products = sum;
    AddProducts(rows, rows + 1, 2, n, products.data());
    std::vector<float> sunk(n + 2, 0);
    const Sink sinks[] = {{sunk.data(), b.data(), 0}, {sunk.data() + 1, nullptr, 2}};
    AddToSinks(sinks, 2, a.data(), n);
    std::vector<float> powers = a;
    ExpRow(0.25F, n, powers.data());
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_FLOAT_EQ(sum[i], 1 + 0.5F * a[i] - 2 * b[i] + 3 * c[i]);
      EXPECT_NEAR(products[i], sum[i] + a[i] * b[i] + b[i] * c[i], 1e-6F);
      EXPECT_NEAR(sunk[i], a[i] * b[i] + (i > 0 ? 2 * a[i - 1] : 0), 1e-6F);
      EXPECT_NEAR(powers[i] / std::exp(std::min(a[i], 0.25F)), 1, 3e-7F);
    }
    EXPECT_EQ(sum[n], 7);  // nothing beyond
    EXPECT_EQ(sunk[n + 1], 0);
  }
}

TEST(RowStreams, ExponentialsFollowTheLibrarys) {
  std::vector<float> s;
  for (float x = -100; x < 5; x += 0.37F) {
    s.push_back(x);
  }
  std::vector<float> powers = s;
  ExpRow(3, s.size(), powers.data());
  for (std::size_t i = 0; i < s.size(); ++i) {
    const float expected = s[i] < -87 ? 0 : std::exp(std::min(s[i], 3.0F));
    EXPECT_NEAR(powers[i], expected, 3e-7F * expected) << s[i];
  }
}

TEST(RowStreams, GramIsThatOfAPlainLoop) {
  RandomStream random(5, 0);
  constexpr std::size_t kRows = 37;
  constexpr std::size_t kColumns = 6;
  std::vector<double> columns(kRows * kColumns);
  std::vector<double> weight(kRows);
  for (double& value : columns) {
    value = random.Uniform() - 0.5;
  }
  for (double& value : weight) {
    value = random.Uniform();
  }
  std::vector<double> gram(kColumns * kColumns);
  WeightedGram(columns.data(), weight.data(), kRows, kColumns, gram.data());
  for (std::size_t b = 0; b < kColumns; ++b) {
    for (std::size_t a = b; a < kColumns; ++a) {
      double sum = 0;
      for (std::size_t i = 0; i < kRows; ++i) {
        sum += weight[i] * columns[a * kRows + i] * columns[b * kRows + i];
      }
      EXPECT_NEAR(gram[b * kColumns + a], sum, 1e-13);
    }
  }
}

// With a rest, sides and scales.
TEST(ReciprocalTotals, AreTheSumsOfWindows) {
  RandomStream random(7, 0);
  Material m;
  m.form = Form::kReciprocal;
  m.points_x = 9;
  m.points_y = 7;
  m.core = 5;
  m.pitch_mm = 0.5;
  m.channels = {"R", "G"};
  m.terms = 2;
  m.taps = 3;
  m.rest = 1;
  m.sides = 1;
  m.margin = 2;
  m.a = {0.3, 2};
  m.b = {1, 1};
  m.f = Draws(random, static_cast<std::size_t>(m.MapCount() * m.MapSize()));
  m.h = Draws(random, static_cast<std::size_t>(2 * m.KernelCount() * m.KernelSize()));
  m.cluster.assign(static_cast<std::size_t>(m.PointCount()), 0);
  m.row_scale.assign(static_cast<std::size_t>(2 * m.PointCount()), 1.0F);
  m.row_scale[12] = 0.75F;
  m.albedo.assign(m.row_scale.size(), 0.0F);
  Validate(m, "made here");
  const std::vector<double> totals = ReciprocalTotals(m, {.thread_count = 2});
  EXPECT_EQ(totals, ReciprocalTotals(m, {.thread_count = 1}));
  std::vector<float> window(static_cast<std::size_t>(m.WindowSize()));
  for (int c = 0; c < 2; ++c) {
    for (int n = 0; n < m.PointCount(); ++n) {
      m.EvaluateWindow(c, n % m.points_x, n / m.points_x, window.data());
      const double sum = std::accumulate(window.begin(), window.end(), 0.0);
      EXPECT_NEAR(
          totals[static_cast<std::size_t>(c * m.PointCount() + n)], sum, 1e-5 * sum);
    }
  }
}

}  // namespace
}  // namespace nacre::factor::internal

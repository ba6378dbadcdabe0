// The inner loops against plain ones, and against long double. Bounds are those of
// rounding, set before anything was measured: a sum whose terms pass n roundings is off
// by at most n u / (1 − n u) of the sum of their magnitudes, u = 2⁻²⁴ for floats
// [Higham02, lemma 3.1].

#include "core/random.h"
#include "factor/internal/reciprocal_sums.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/row_kernels.h"
#include "factor/internal/row_scans.h"
#include "factor/internal/row_streams.h"
#include "factor/internal/window_totals.h"
#include "factor/material.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <hwy/targets.h>
#include <limits>

namespace nacre::factor::internal {
namespace {

using Wide = long double;
constexpr Wide kUnit = 0x1p-24L;
constexpr Wide kUnitOfDouble = 0x1p-53L;
constexpr Wide kHalfLeast = 0x1p-150L;  // what a product loses that underflows

constexpr Wide SumRounding(std::size_t n, Wide u = kUnit) {
  const Wide nu = static_cast<Wide>(n) * u;
  return nu / (1 - nu);
}

Wide W(float value) {
  return static_cast<Wide>(value);
}

// Of both signs over twelve decades, with zeros and denormal numbers among them.
std::vector<float> DrawDecades(std::uint64_t seed, std::size_t count) {
  RandomStream random(seed, 0);
  std::vector<float> values(count);
  for (std::size_t n = 0; n < count; ++n) {
    const double sign = random.Uniform() < 0.5 ? -1 : 1;
    values[n] = static_cast<float>(sign * std::pow(10, -12 * random.Uniform()));
    values[n] = n % 31 == 30 ? 0.0F : n % 37 == 36 ? values[n] * 1e-38F : values[n];
  }
  return values;
}

bool SameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

// Highway's choice of instructions, one after the other.
template <class Check>
void OnEachTarget(Check&& check) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    check(target <= HWY_AVX2);  // that fuse products and sums; better ones are lower
  }
  hwy::SetSupportedTargetsForTest(0);
}

// What two sinks, the second of them one further, come to: blocks of 32 values, of 4
// and of 1 decide on the order of sums.
std::vector<float> InBlocks(const float* r,
                            const float* first_by,
                            const float* second_by,
                            std::size_t n) {
  std::vector<float> to(n + 1, 0.1F);
  for (std::size_t i = 0; i < n;) {
    const std::size_t block = i + 32 <= n ? 32 : i + 4 <= n ? 4 : 1;
    for (std::size_t k = i; k < i + block; ++k) {
      to[k] += first_by[k] * r[k];
    }
    for (std::size_t k = i; k < i + block; ++k) {
      to[k + 1] += second_by[k] * r[k];
    }
    i += block;
  }
  return to;
}

void CheckRowStreams() {
  constexpr std::size_t kCount = 5;
  for (const std::size_t n : {1U, 3U, 15U, 16U, 17U, 63U, 64U, 65U, 130U, 1001U}) {
    std::vector<std::vector<float>> draws;
    std::vector<const float*> rows;
    for (std::size_t q = 0; q < kCount; ++q) {
      draws.push_back(DrawDecades(q, n));
      rows.push_back(draws.back().data());
    }
    const std::vector<float> weights = DrawDecades(9, kCount);
    std::vector<float> sum(n);
    LinearCombination(rows.data(), weights.data(), kCount, 0.3F, n, sum.data());
    std::vector<float> products = sum;
    AddProducts(rows.data(), &rows[1], kCount - 1, n, products.data());
    std::vector<float> sunk = sum;
    std::vector<float> weighted = sum;
    const Sink sinks[] = {{sunk.data(), rows[1], 0}, {weighted.data(), nullptr, 3e-5F}};
    AddToSinks(sinks, 2, rows[0], n);
    std::vector<float> twice(n + 1, 0.1F);
    const Sink overlapping[] = {{twice.data(), rows[1], 0}, {&twice[1], rows[2], 0}};
    AddToSinks(overlapping, 2, rows[0], n);
    ASSERT_EQ(twice, InBlocks(rows[0], rows[1], rows[2], n)) << n;
    std::vector<double> totals(n, 0.1);
    AddToSums(rows[0], n, totals.data());
    for (std::size_t i = 0; i < n; ++i) {
      float plain = 0.3F;
      Wide exact = W(0.3F);
      Wide magnitude = exact;
      for (std::size_t q = 0; q < kCount; ++q) {
        plain += weights[q] * rows[q][i];
        exact += W(weights[q]) * W(rows[q][i]);
        magnitude += std::abs(W(weights[q]) * W(rows[q][i]));
      }
      ASSERT_TRUE(SameBits(sum[i], plain)) << n << ' ' << i;
      ASSERT_LE(std::abs(W(sum[i]) - exact),
                SumRounding(kCount + 1) * magnitude + kCount * kHalfLeast);
      exact = W(plain);
      magnitude = std::abs(exact);
      for (std::size_t q = 0; q + 1 < kCount; ++q) {
        plain += rows[q][i] * rows[q + 1][i];
        exact += W(rows[q][i]) * W(rows[q + 1][i]);
        magnitude += std::abs(W(rows[q][i]) * W(rows[q + 1][i]));
      }
      ASSERT_TRUE(SameBits(products[i], plain)) << n << ' ' << i;
      ASSERT_LE(std::abs(W(products[i]) - exact),
                SumRounding(kCount) * magnitude + kCount * kHalfLeast);
      ASSERT_TRUE(SameBits(sunk[i], sum[i] + rows[1][i] * rows[0][i]));
      ASSERT_TRUE(SameBits(weighted[i], sum[i] + 3e-5F * rows[0][i]));
      ASSERT_EQ(totals[i], 0.1 + static_cast<double>(rows[0][i]));
    }
  }
}

TEST(FactorOracles, RowStreamsAreThePlainLoopsToTheBit) {
  OnEachTarget([](bool) { CheckRowStreams(); });
}

// x − k ln 2 is off by u (the product with the low part of ln 2 and the difference,
// both below 0.36), 1 + r + r² p by 1.6 u of the result (a last rounding of at most u,
// one of r of 0.35 u and three of r² p ≤ 0.07), and the polynomial by 2·10⁻⁸:
// 2.6 u + 2·10⁻⁸ is below the 2·10⁻⁷ that the header states.
TEST(FactorOracles, ExponentialsAreThoseOfLongDouble) {
  std::vector<float> x;
  for (float value = -87; value < 3.2F; value += 1.37e-4F) {
    x.push_back(value);
  }
  std::vector<float> row = x;
  ExpRow(3, row.size(), row.data());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Wide exact = x[i] > -87 ? std::exp(W(std::min(x[i], 3.0F))) : 0;
    ASSERT_LE(std::abs(W(row[i]) - exact), 2e-7L * exact) << x[i];
    float alone = x[i];
    ExpRow(3, 1, &alone);
    ASSERT_TRUE(SameBits(alone, row[i])) << x[i];
  }
}

// A product of three numbers and a sum of n: n + 2 roundings at most.
TEST(FactorOracles, GramIsThatOfLongDouble) {
  constexpr std::size_t kRows = 1003;
  constexpr std::size_t kColumns = 5;
  const std::vector<float> draws = DrawDecades(4, kRows * (kColumns + 1));
  std::vector<double> columns(draws.begin(), draws.end() - kRows);
  std::vector<double> weight(draws.end() - kRows, draws.end());
  for (double& value : weight) {
    value = std::abs(value);
  }
  std::vector<double> gram(kColumns * kColumns);
  WeightedGram(columns.data(), weight.data(), kRows, kColumns, gram.data());
  for (std::size_t b = 0; b < kColumns; ++b) {
    for (std::size_t a = b; a < kColumns; ++a) {
      Wide exact = 0;
      Wide magnitude = 0;
      for (std::size_t i = 0; i < kRows; ++i) {
        const Wide term = static_cast<Wide>(weight[i]) *
                          static_cast<Wide>(columns[a * kRows + i]) *
                          static_cast<Wide>(columns[b * kRows + i]);
        exact += term;
        magnitude += std::abs(term);
      }
      EXPECT_LE(std::abs(static_cast<Wide>(gram[b * kColumns + a]) - exact),
                SumRounding(kRows + 2, kUnitOfDouble) * magnitude);
    }
  }
}

// To the bit those of a loop that fuses products and sums, where the machine does, and
// of one that doesn't, elsewhere; each within the rounding of n products.
TEST(FactorOracles, PanelsAreThePlainLoopsToTheBitOnEveryTarget) {
  constexpr std::int64_t kCount = 37;
  constexpr std::int64_t kWidth = 64;
  const std::vector<float> y = DrawDecades(1, kCount * kWidth);
  const std::vector<float> v = DrawDecades(2, kWidth * kPanel);
  const std::vector<float> w = DrawDecades(3, kCount * kPanel);
  const auto at = [](const std::vector<float>& m, std::int64_t n) {
    return m[static_cast<std::size_t>(n)];
  };
  const auto add = [](bool fused, float a, float b, float sum) {
    return fused ? std::fma(a, b, sum) : sum + a * b;
  };
  OnEachTarget([&](bool fused) {
    std::vector<float> u(kCount * kPanel);
    MultiplyPanel({y.data(), kCount, kWidth}, v.data(), u.data());
    std::vector<double> z(kWidth * kPanel, 0.5);
    AddTransposedPanel({y.data(), kCount, kWidth}, w.data(), z.data());
    for (std::int64_t n = 0; n < kPanel; ++n) {
      for (std::int64_t i = 0; i < kCount; ++i) {
        float sum = 0;
        Wide exact = 0;
        Wide magnitude = 0;
        for (std::int64_t k = 0; k < kWidth; ++k) {
          const float a = at(y, i * kWidth + k);
          const float b = at(v, k * kPanel + n);
          sum = add(fused, a, b, sum);
          exact += W(a) * W(b);
          magnitude += std::abs(W(a) * W(b));
        }
        ASSERT_TRUE(SameBits(at(u, i * kPanel + n), sum));
        ASSERT_LE(std::abs(W(sum) - exact),
                  SumRounding(kWidth) * magnitude + kWidth * kHalfLeast);
      }
      for (std::int64_t k = 0; k < kWidth; ++k) {
        float sum = 0;
        for (std::int64_t i = 0; i < kCount; ++i) {
          sum = add(fused, at(y, i * kWidth + k), at(w, i * kPanel + n), sum);
        }
        ASSERT_EQ(z[static_cast<std::size_t>(k * kPanel + n)],
                  0.5 + static_cast<double>(sum));
      }
    }
  });
}

// The header's 5·10⁻⁷ of the logarithm, of each target; a product of two rounded
// numbers is within 2 u, its root within 2 u as well.
TEST(FactorOracles, TransformsAreThoseOfLongDoubleOnEveryTarget) {
  std::vector<float> rd = DrawDecades(5, 101);
  for (float& value : rd) {
    value = value < 0 ? 0.4F * value : value;  // the logarithm's argument above 1/2
    value = std::abs(value) < 1e-20F ? 0.0F : value;
  }
  const auto n = static_cast<std::int64_t>(rd.size());
  for (const RowTransform& t : {RowTransform{true, 0.8, 1},
                                RowTransform{true, 2, 0.5},
                                RowTransform{false, 0.02, 1},
                                RowTransform{.a = 0.02, .is_root = true}}) {
    OnEachTarget([&](bool) {
      std::vector<float> s(static_cast<std::size_t>(PaddedColumns(n)), 7);
      const float squares = TransformFloats(t, rd, s.data());
      Wide sum = 0;
      for (std::size_t k = 0; k < rd.size(); ++k) {
        const Wide x = W(rd[k]) / (static_cast<Wide>(t.a) *
                                   (t.is_log ? static_cast<Wide>(t.b) : 1));
        Wide exact = t.is_root ? std::copysign(std::sqrt(std::abs(x)), x) : x;
        Wide bound = 2.01L * kUnit * std::abs(exact);
        if (t.is_log) {
          const Wide shift = std::log(static_cast<Wide>(t.b));
          exact = shift + std::log1p(x);
          bound = 5e-7L * (std::abs(shift) + std::abs(std::log1p(x)));
        }
        ASSERT_LE(std::abs(W(s[k]) - exact), bound) << rd[k] << ' ' << t.a;
        sum += exact * exact;
      }
      EXPECT_LE(std::abs(W(squares) - sum), (SumRounding(rd.size()) + 2e-6L) * sum);
    });
  }
}

// s passes 2 J roundings and those of the difference to ln B and of ln B itself; the
// library states 4 units in the last place for e^s − 1, which are 8 u; two more
// products; a sum of the window's values.
TEST(FactorOracles, TotalsOfWindowsAreThoseOfLongDoubleOnEveryTarget) {
  Material m;
  m.points_x = 3;
  m.points_y = 2;
  m.core = 7;
  m.channels = {"R"};
  m.terms = 4;
  m.transform = Transform::kLog;
  m.a = {3e-12};
  m.b = {0.7};
  m.f.assign(static_cast<std::size_t>(m.terms * m.PointCount()), 1);
  m.h = DrawDecades(6, static_cast<std::size_t>(m.terms * m.WindowSize()));
  for (std::size_t d = 0; d < 49; ++d) {  // twelve decades of R_d
    m.h[d] = 27.6F * static_cast<float>(d) / 48;
  }
  std::vector<double> totals(6);
  OnEachTarget([&](bool) {
    WindowTotals(m, 0, 0, 6, totals.data());
    const Wide a = static_cast<Wide>(m.a[0]) * static_cast<Wide>(m.b[0]);
    const Wide shift = std::log(static_cast<Wide>(m.b[0]));
    Wide exact = 0;
    Wide bound = 0;
    for (std::size_t d = 0; d < 49; ++d) {
      Wide s = 0;
      Wide magnitude = 2 * std::abs(shift);
      for (std::size_t j = 0; j < 4; ++j) {
        s += W(m.h[j * 49 + d]);
        magnitude += std::abs(W(m.h[j * 49 + d]));
      }
      const Wide value = std::max(0.0L, a * std::expm1(s - shift));
      exact += value;
      bound += a * std::exp(s - shift) * SumRounding(2 * 4 + 2) * magnitude +
               (8 + 3) * kUnit * std::abs(a * std::expm1(s - shift));
    }
    bound += SumRounding(49) * exact;
    for (const double total : totals) {
      EXPECT_LE(std::abs(static_cast<Wide>(total) - exact), bound);
    }
    EXPECT_LT(bound, 1e-4L * exact);
  });
}

// The exponent's terms pass 4 J + 6 roundings at most on the longest way (J inner
// products, J outer ones, taps and ends), an exponential is off by 2·10⁻⁷ of itself,
// scales by two roundings; sums are in double.
TEST(FactorOracles, ReciprocalTotalsAreThoseOfLongDouble) {
  constexpr int kTerms = 3;
  Material m;
  m.form = Form::kReciprocal;
  m.points_x = 6;
  m.points_y = 5;
  m.core = 5;
  m.pitch_mm = 0.5;
  m.channels = {"R"};
  m.terms = kTerms;
  m.margin = 2;
  m.a = {0.3};
  m.b = {1};
  RandomStream random(7, 0);
  const auto draw = [&](std::int64_t count) {
    std::vector<float> values(static_cast<std::size_t>(count));
    for (float& value : values) {
      value = static_cast<float>(random.Uniform() - 0.5);
    }
    return values;
  };
  m.f = draw(kTerms * m.MapSize());
  m.h = draw(m.KernelCount() * m.KernelSize());
  for (std::size_t d = 0; d < 13; ++d) {  // the constant: twelve decades
    m.h[d] -= 27.6F * static_cast<float>(12 - d) / 12;
  }
  m.cluster.assign(30, 0);
  m.row_scale.assign(30, 1);
  m.row_scale[7] = 0.75F;
  m.albedo.assign(30, 0);
  Validate(m, "made here");
  const std::vector<double> totals = ReciprocalTotals(m, {.thread_count = 1});
  const auto scale = [&](int i, int j) {
    return i < 0 || j < 0 || i >= 6 || j >= 5
               ? 1
               : W(m.row_scale[static_cast<std::size_t>(j * 6 + i)]);
  };
  for (int p = 0; p < 30; ++p) {
    Wide exact = 0;
    Wide bound = 0;
    for (int cell = 0; cell < 25; ++cell) {
      const int du = cell % 5 - 2;
      const int dv = cell / 5 - 2;
      const int half = std::min(cell, 24 - cell);  // h(−d) = h(d)
      const auto h = [&](int k) { return W(m.Kernel(0, 0, k)[half]); };
      const auto f = [&](int j, int dx, int dy) {
        return W(m.FactorMap(0, j)[(p / 6 + 2 + dy) * m.MapWidth() + p % 6 + 2 + dx]);
      };
      Wide s = h(0);
      Wide magnitude = std::abs(s);
      const auto add = [&](Wide term) {
        s += term;
        magnitude += std::abs(term);
      };
      for (int j = 0; j < kTerms; ++j) {
        add(h(TapKernel(kTerms, 0, j)) * f(j, 0, 0));
        add(h(TapKernel(kTerms, 0, j)) * f(j, du, dv));
        for (int k = j; k < kTerms; ++k) {
          const Wide pair = h(PairKernel(kTerms, m.taps, j, k));
          add(pair * f(j, 0, 0) * f(k, du, dv));
          add(pair * f(k, 0, 0) * f(j, du, dv));
        }
      }
      const Wide rd = static_cast<Wide>(m.a[0]) * scale(p % 6, p / 6) *
                      scale(p % 6 + du, p / 6 + dv) *
                      std::exp(std::min(s, W(static_cast<float>(kMostLog))));
      exact += rd;
      bound += rd * (SumRounding(4 * kTerms + 6) * magnitude + 2e-7L + 3 * kUnit);
    }
    EXPECT_LE(std::abs(static_cast<Wide>(totals[static_cast<std::size_t>(p)]) - exact),
              bound)
        << p;
    EXPECT_LT(bound, 1e-4L * exact);
  }
}

TEST(FactorOracles, ScansAreThoseOfLongDouble) {
  for (const std::size_t n : {1U, 15U, 16U, 49U, 1003U}) {
    std::vector<float> rd = DrawDecades(n, n);
    RowScans scans(1, 1);
    scans.Add(0, 0, rd);
    Wide exact = 0;
    Wide magnitude = 0;
    for (const float value : rd) {
      exact += W(value);
      magnitude += std::abs(W(value));
    }
    EXPECT_LE(std::abs(static_cast<Wide>(scans.total[0]) - exact),
              SumRounding(n, kUnitOfDouble) * magnitude);
    EXPECT_EQ(scans.low[0], *std::min_element(rd.begin(), rd.end()));
    EXPECT_EQ(scans.high[0], *std::max_element(rd.begin(), rd.end()));
    EXPECT_TRUE(scans.AreRegular(0, -2));
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                            -std::numeric_limits<float>::infinity()}) {
      rd[n / 2] = bad;
      scans.Add(0, 0, rd);
      EXPECT_FALSE(scans.AreRegular(0, -2)) << n;
    }
  }
}

}  // namespace
}  // namespace nacre::factor::internal

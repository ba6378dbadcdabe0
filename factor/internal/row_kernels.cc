// The inner loops of the block iteration, compiled once for each instruction set.
// clang-format off: the order matters
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "factor/internal/row_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include "factor/internal/row_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#ifndef NACRE_FACTOR_ROW_SCALING_
#define NACRE_FACTOR_ROW_SCALING_
namespace nacre::factor::internal {
struct Scaling {
  bool is_log, is_root;
  float scale, shift;
};
}  // namespace nacre::factor::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace nacre::factor::internal {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kPanel>;
using F = hn::Vec<Floats>;
constexpr std::int64_t kLanes = static_cast<std::int64_t>(hn::MaxLanes(Floats()));
constexpr std::int64_t kVectors = kPanel / kLanes;  // of a panel's row
// Rows of the product kept in registers: as many as there are for them.
constexpr int kTile = kLanes >= 16 ? 16 : kLanes == 8 ? 6 : kLanes == 4 ? 3 : 1;

inline HWY_ATTR F Set(float value) {
  return hn::Set(Floats(), value);
}

// ln(1 + x) for x ≥ −1/2, to 5e-7 of itself. 1 + x = 2^e m, m in [√½, √2); where e is
// 0, m − 1 is x itself and nothing is lost. ln m = f − f²/2 + f³ p(f), f = m − 1, with
// a least-maximum polynomial p.
inline HWY_ATTR F Log1p(F x) {
  const hn::RebindToUnsigned<Floats> du;
  const hn::RebindToSigned<Floats> di;
  const auto root_half = hn::Set(du, 0x3F3504F3U);
  const auto offset = hn::Sub(hn::BitCast(du, hn::Add(x, Set(1.0F))), root_half);
  const auto e = hn::ShiftRight<23>(hn::BitCast(di, offset));
  const F exponent = hn::ConvertTo(Floats(), e);
  const F m = hn::BitCast(
      Floats(), hn::Add(hn::And(offset, hn::Set(du, 0x007FFFFFU)), root_half));
  const F f =
      hn::IfThenElse(hn::Eq(exponent, hn::Zero(Floats())), x, hn::Sub(m, Set(1.0F)));
  const F f2 = hn::Mul(f, f);
  const F p01 = hn::MulAdd(Set(-0.24980572F), f, Set(0.33334691F));
  const F p23 = hn::MulAdd(Set(-0.17166941F), f, Set(0.19910244F));
  const F p45 = hn::MulAdd(Set(-0.10224003F), f, Set(0.16141125F));
  const F p = hn::MulAdd(f2, hn::MulAdd(f2, p45, p23), p01);
  const F tail = hn::MulSub(hn::Mul(f2, f), p, hn::Mul(Set(0.5F), f2));
  return hn::MulAdd(exponent, Set(0.693147181F), hn::Add(f, tail));
}

struct Log {
  F scale, shift;
  HWY_ATTR F operator()(F rd) const {
    return hn::Add(shift, Log1p(hn::Mul(rd, scale)));
  }
};

struct Linear {
  F scale;
  HWY_ATTR F operator()(F rd) const { return hn::Mul(rd, scale); }
};

struct Root {
  F scale;
  HWY_ATTR F operator()(F rd) const {
    const F x = hn::Mul(rd, scale);
    return hn::CopySign(hn::Sqrt(hn::Abs(x)), x);
  }
};

template <class Forward>
HWY_ATTR float Apply(const Forward& forward,
                     const float* rd,
                     std::int64_t n,
                     float* y) {
  const Floats d;
  F squares = hn::Zero(d);
  std::int64_t at = 0;
  for (; at + kLanes <= n; at += kLanes) {
    const F s = forward(hn::LoadU(d, rd + at));
    squares = hn::MulAdd(s, s, squares);
    hn::StoreU(s, d, y + at);
  }
  float sum = hn::GetLane(hn::SumOfLanes(d, squares));
  if (at < n) {
    std::array<float, kPanel> rest{};
    std::copy(rd + at, rd + n, rest.begin());
    hn::StoreU(forward(hn::LoadU(d, rest.data())), d, rest.data());
    for (std::int64_t k = 0; at < n; ++at, ++k) {
      y[at] = rest[static_cast<std::size_t>(k)];
      sum += y[at] * y[at];
    }
  }
  std::fill(y + n, y + PaddedColumns(n), 0.0F);
  return sum;
}

HWY_ATTR float Transform(const Scaling& t, std::span<const float> rd, float* y) {
  const auto n = static_cast<std::int64_t>(rd.size());
  const F scale = Set(t.scale);
  if (t.is_log) {
    return Apply(Log{scale, Set(t.shift)}, rd.data(), n, y);
  }
  return t.is_root ? Apply(Root{scale}, rd.data(), n, y)
                   : Apply(Linear{scale}, rd.data(), n, y);
}

// A matrix that is walked along `inner`, `outer` being the rows of the product.
struct Walk {
  const float* a;
  std::int64_t outer_stride;
  std::int64_t inner_stride;
  std::int64_t inner_count;
};

// out[i][·] = Σ_k a(i, k) b[k][·] for kRows rows i.
template <int kRows>
HWY_ATTR void Tile(const Walk& walk, const float* b, float* out) {
  const Floats d;
  F sum[kRows][kVectors];
  for (int i = 0; i < kRows; ++i) {
    for (int n = 0; n < kVectors; ++n) {
      sum[i][n] = hn::Zero(d);
    }
  }
  for (std::int64_t k = 0; k < walk.inner_count; ++k) {
    F row[kVectors];
    for (int n = 0; n < kVectors; ++n) {
      row[n] = hn::LoadU(d, b + k * kPanel + n * kLanes);
    }
    const float* a = walk.a + k * walk.inner_stride;
    for (int i = 0; i < kRows; ++i) {
      const F factor = hn::Set(d, a[i * walk.outer_stride]);
      for (int n = 0; n < kVectors; ++n) {
        sum[i][n] = hn::MulAdd(factor, row[n], sum[i][n]);
      }
    }
  }
  for (int i = 0; i < kRows; ++i) {
    for (int n = 0; n < kVectors; ++n) {
      hn::StoreU(sum[i][n], d, out + i * kPanel + n * kLanes);
    }
  }
}

HWY_ATTR void Multiply(const RowBlock& y, const float* v, float* u) {
  Walk walk{y.rows, y.width, 1, y.width};
  std::int64_t row = 0;
  for (; row + kTile <= y.count; row += kTile) {
    walk.a = y.rows + row * y.width;
    Tile<kTile>(walk, v, u + row * kPanel);
  }
  for (; row < y.count; ++row) {
    walk.a = y.rows + row * y.width;
    Tile<1>(walk, v, u + row * kPanel);
  }
}

HWY_ATTR void AddTransposed(const RowBlock& y, const float* u, double* z) {
  Walk walk{y.rows, 1, y.width, y.count};
  float sums[kTile * kPanel];
  const auto add = [&](std::int64_t column, int count) {
    double* to = z + column * kPanel;
    for (int n = 0; n < count * kPanel; ++n) {
      to[n] += static_cast<double>(sums[n]);
    }
  };
  std::int64_t column = 0;
  for (; column + kTile <= y.width; column += kTile) {
    walk.a = y.rows + column;
    Tile<kTile>(walk, u, sums);
    add(column, kTile);
  }
  for (; column < y.width; ++column) {
    walk.a = y.rows + column;
    Tile<1>(walk, u, sums);
    add(column, 1);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace nacre::factor::internal
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre::factor::internal {
namespace {

double ScaleOf(const RowTransform& transform) {
  return 1 / (transform.is_log ? transform.a * transform.b : transform.a);
}

}  // namespace

HWY_EXPORT(Transform);
HWY_EXPORT(Multiply);
HWY_EXPORT(AddTransposed);

bool FitsFloats(const RowTransform& transform) {
  constexpr auto kLeast = static_cast<double>(std::numeric_limits<float>::min());
  const double scale = ScaleOf(transform);
  return scale >= kLeast && scale <= 1 / kLeast;
}

float TransformFloats(const RowTransform& transform,
                      std::span<const float> rd,
                      float* row) {
  const Scaling scaling{transform.is_log,
                        transform.is_root,
                        static_cast<float>(ScaleOf(transform)),
                        static_cast<float>(std::log(transform.b))};
  return HWY_DYNAMIC_DISPATCH(Transform)(scaling, rd, row);
}

float CopyRow(std::span<const double> values, float* row) {
  float sum = 0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    row[n] = static_cast<float>(values[n]);
    sum += row[n] * row[n];
  }
  const auto size = static_cast<std::int64_t>(values.size());
  std::fill(row + size, row + PaddedColumns(size), 0.0F);
  return sum;
}

void MultiplyPanel(const RowBlock& y, const float* v, float* u) {
  HWY_DYNAMIC_DISPATCH(Multiply)(y, v, u);
}

void AddTransposedPanel(const RowBlock& y, const float* u, double* z) {
  HWY_DYNAMIC_DISPATCH(AddTransposed)(y, u, z);
}

}  // namespace nacre::factor::internal
#endif

// Totals of modelled slices, compiled once for each instruction set.
// The order of these matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "factor/internal/window_totals.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

#include "factor/internal/window_totals.h"

#include <algorithm>
#include <array>
#include <cmath>

#ifndef NACRE_FACTOR_WINDOW_SUM_
#define NACRE_FACTOR_WINDOW_SUM_
namespace nacre::factor::internal {
struct WindowSum {
  Transform transform;
  float scale;  // A B
  float shift;  // ln B
  const float* h;
  std::int64_t terms;
  std::int64_t window;
};
}  // namespace nacre::factor::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace nacre::factor::internal {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using F = hn::Vec<Floats>;
constexpr std::int64_t kLanes = static_cast<std::int64_t>(hn::MaxLanes(Floats()));

HWY_ATTR F Undo(const WindowSum& sum, F s) {
  const Floats d;
  if (sum.transform == Transform::kLog) {
    const F x = hn::Sub(s, hn::Set(d, sum.shift));
    s = hn::Mul(hn::Set(d, sum.scale), hn::Expm1(d, x));
  } else if (sum.transform == Transform::kSqrt) {
    s = hn::Mul(s, hn::Abs(s));
  }
  return hn::Max(s, hn::Zero(d));
}

HWY_ATTR double Total(const WindowSum& sum, const float* f) {
  const Floats d;
  F total = hn::Zero(d);
  std::int64_t at = 0;
  for (; at + kLanes <= sum.window; at += kLanes) {
    F s = hn::Zero(d);
    for (std::int64_t j = 0; j < sum.terms; ++j) {
      s = hn::MulAdd(hn::Set(d, f[j]), hn::LoadU(d, sum.h + j * sum.window + at), s);
    }
    total = hn::Add(total, Undo(sum, s));
  }
  std::array<float, 16> lanes{};
  hn::StoreU(total, d, lanes.data());
  double result = 0;
  for (const float lane : lanes) {
    result += static_cast<double>(lane);
  }
  if (at < sum.window) {
    lanes.fill(0.0F);
    for (std::int64_t n = at; n < sum.window; ++n) {
      for (std::int64_t j = 0; j < sum.terms; ++j) {
        lanes[static_cast<std::size_t>(n - at)] += f[j] * sum.h[j * sum.window + n];
      }
    }
    hn::StoreU(Undo(sum, hn::LoadU(d, lanes.data())), d, lanes.data());
    for (std::int64_t n = at; n < sum.window; ++n) {
      result += static_cast<double>(lanes[static_cast<std::size_t>(n - at)]);
    }
  }
  return result;
}

}  // namespace HWY_NAMESPACE
}  // namespace nacre::factor::internal
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre::factor::internal {

HWY_EXPORT(Total);

void WindowTotals(const Material& m,
                  int channel,
                  std::int64_t first,
                  std::int64_t count,
                  double* totals) {
  const auto c = static_cast<std::size_t>(channel);
  const WindowSum sum{m.transform,
                      static_cast<float>(m.a[c] * m.b[c]),
                      static_cast<float>(std::log(m.b[c])),
                      m.Kernel(channel, 0, 0),
                      m.terms,
                      m.WindowSize()};
  std::vector<float> f(static_cast<std::size_t>(m.terms));
  for (std::int64_t n = 0; n < count; ++n) {
    for (int j = 0; j < m.terms; ++j) {
      f[static_cast<std::size_t>(j)] = m.FactorMap(channel, j)[first + n];
    }
    totals[n] = HWY_DYNAMIC_DISPATCH(Total)(sum, f.data());
  }
}

}  // namespace nacre::factor::internal
#endif

// Rows of numbers added up in registers, compiled once for each instruction set. No sum
// is contracted and none depends on how many lanes there are: the bits are the same.
// clang-format off: the order matters
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "factor/internal/row_streams.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include "factor/internal/row_streams.h"

#include <bit>
#include <cstdint>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace nacre::factor::internal {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
constexpr std::size_t kWide = hn::MaxLanes(Floats());

HWY_ATTR void LinearCombination(const float* const* rows,
                                const float* weights,
                                std::size_t count,
                                float first,
                                std::size_t n,
                                float* to) {
  const Floats lanes;
  std::size_t i = 0;
  for (; i + 4 * kWide <= n; i += 4 * kWide) {
    auto a = hn::Set(lanes, first);
    auto b = a;
    auto c = a;
    auto d = a;
    for (std::size_t q = 0; q < count; ++q) {
      const float* row = rows[q] + i;
      const auto weight = hn::Set(lanes, weights[q]);
      a = hn::Add(a, hn::Mul(weight, hn::LoadU(lanes, row)));
      b = hn::Add(b, hn::Mul(weight, hn::LoadU(lanes, row + kWide)));
      c = hn::Add(c, hn::Mul(weight, hn::LoadU(lanes, row + 2 * kWide)));
      d = hn::Add(d, hn::Mul(weight, hn::LoadU(lanes, row + 3 * kWide)));
    }
    hn::StoreU(a, lanes, to + i);
    hn::StoreU(b, lanes, to + i + kWide);
    hn::StoreU(c, lanes, to + i + 2 * kWide);
    hn::StoreU(d, lanes, to + i + 3 * kWide);
  }
  for (; i < n && n >= kWide; i += kWide) {
    i = i < n - kWide ? i : n - kWide;  // some at the end once more
    auto a = hn::Set(lanes, first);
    for (std::size_t q = 0; q < count; ++q) {
      a = hn::Add(a,
                  hn::Mul(hn::Set(lanes, weights[q]), hn::LoadU(lanes, rows[q] + i)));
    }
    hn::StoreU(a, lanes, to + i);
  }
  for (; i < n; ++i) {
    float a = first;
    for (std::size_t q = 0; q < count; ++q) {
      a += weights[q] * rows[q][i];
    }
    to[i] = a;
  }
}

HWY_ATTR void AddProducts(const float* const* a,
                          const float* const* b,
                          std::size_t count,
                          std::size_t n,
                          float* to) {
  const Floats lanes;
  std::size_t i = 0;
  for (; i + kWide <= n; i += kWide) {
    auto sum = hn::LoadU(lanes, to + i);
    for (std::size_t q = 0; q < count; ++q) {
      sum =
          hn::Add(sum, hn::Mul(hn::LoadU(lanes, a[q] + i), hn::LoadU(lanes, b[q] + i)));
    }
    hn::StoreU(sum, lanes, to + i);
  }
  for (; i < n; ++i) {
    for (std::size_t q = 0; q < count; ++q) {
      to[i] += a[q][i] * b[q][i];
    }
  }
}

// A block of `kBlock` values to each sink. Sinks overlap, so that the blocks decide on
// the order of sums: they are the same for any number of lanes.
template <std::size_t kBlock>
HWY_ATTR void AddBlock(const Sink* sinks,
                       std::size_t count,
                       const float* r,
                       std::size_t i) {
  const hn::CappedTag<float, kBlock> lanes;
  constexpr std::size_t kLanes = hn::MaxLanes(lanes);
  for (std::size_t q = 0; q < count; ++q) {
    const Sink& sink = sinks[q];
    for (std::size_t at = i; at < i + kBlock; at += kLanes) {
      const auto by = sink.by != nullptr ? hn::LoadU(lanes, sink.by + at)
                                         : hn::Set(lanes, sink.weight);
      const auto product = hn::Mul(by, hn::LoadU(lanes, r + at));
      hn::StoreU(hn::Add(hn::LoadU(lanes, sink.to + at), product), lanes, sink.to + at);
    }
  }
}

HWY_ATTR void AddToSinks(const Sink* sinks,
                         std::size_t count,
                         const float* r,
                         std::size_t n) {
  std::size_t i = 0;
  for (; i + 32 <= n; i += 32) {
    AddBlock<32>(sinks, count, r, i);
  }
  for (; i + 4 <= n; i += 4) {
    AddBlock<4>(sinks, count, r, i);
  }
  for (; i < n; ++i) {
    AddBlock<1>(sinks, count, r, i);
  }
}

// exp x = 2^k exp r, k the nearest whole number to x / ln 2; a minimax polynomial of r.
HWY_ATTR void ExpRow(float most, std::size_t n, float* s) {
  constexpr float kLeast = -87;
  constexpr float kShift = 12582912;  // 1.5 · 2^23: added, it rounds
  constexpr float kHighLn2 = 0.693359375F;
  constexpr float kLowLn2 = -2.12194440e-4F;
  for (std::size_t i = 0; i < n; ++i) {
    const float less = most < s[i] ? most : s[i];
    const float x = less < kLeast ? kLeast : less;
    const float shifted = x * 1.44269504F + kShift;
    const float k = shifted - kShift;
    const float r = (x - k * kHighLn2) - k * kLowLn2;
    float p = 1.9875691500e-4F;
    p = p * r + 1.3981999507e-3F;
    p = p * r + 8.3334519073e-3F;
    p = p * r + 4.1665795894e-2F;
    p = p * r + 1.6666665459e-1F;
    p = p * r + 5.0000001201e-1F;
    p = p * r * r + r + 1;
    const auto exponent = (std::bit_cast<std::uint32_t>(shifted) -
                           std::bit_cast<std::uint32_t>(kShift) + 127U)
                          << 23U;
    const float value = p * std::bit_cast<float>(exponent);
    s[i] = x > kLeast ? value : 0.0F;
  }
}

// Σ of eight sums, each over every eighth product, then of the rest: of one column,
// `weighted`, with four others at a time.
constexpr std::size_t kSums = 8;
using Doubles = hn::CappedTag<double, kSums>;
constexpr std::size_t kParts = kSums / hn::MaxLanes(Doubles());

HWY_ATTR void FourProducts(const double* weighted,
                           const double* const* others,
                           std::size_t n,
                           double* products) {
  const Doubles lanes;
  constexpr std::size_t kLanes = kSums / kParts;
  hn::Vec<Doubles> sums[4][kParts];
  for (auto& of_column : sums) {
    for (auto& sum : of_column) {
      sum = hn::Zero(lanes);
    }
  }
  std::size_t i = 0;
  for (; i + kSums <= n; i += kSums) {
    for (std::size_t part = 0; part < kParts; ++part) {
      const std::size_t at = i + part * kLanes;
      const auto w = hn::LoadU(lanes, weighted + at);
      for (std::size_t k = 0; k < 4; ++k) {
        const auto product = hn::Mul(w, hn::LoadU(lanes, others[k] + at));
        sums[k][part] = hn::Add(sums[k][part], product);
      }
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    double each[kSums];
    for (std::size_t part = 0; part < kParts; ++part) {
      hn::StoreU(sums[k][part], lanes, each + part * kLanes);
    }
    double sum = 0;
    for (const double one : each) {
      sum += one;
    }
    for (std::size_t rest = i; rest < n; ++rest) {
      sum += weighted[rest] * others[k][rest];
    }
    products[k] = sum;
  }
}

HWY_ATTR void AddToSums(const float* values, std::size_t n, double* sums) {
  for (std::size_t i = 0; i < n; ++i) {
    sums[i] += static_cast<double>(values[i]);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace nacre::factor::internal
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nacre::factor::internal {

HWY_EXPORT(LinearCombination);
HWY_EXPORT(AddProducts);
HWY_EXPORT(AddToSinks);
HWY_EXPORT(ExpRow);
HWY_EXPORT(FourProducts);
HWY_EXPORT(AddToSums);

void LinearCombination(const float* const* rows,
                       const float* weights,
                       std::size_t count,
                       float first,
                       std::size_t n,
                       float* to) {
  HWY_DYNAMIC_DISPATCH(LinearCombination)(rows, weights, count, first, n, to);
}

void AddProducts(const float* const* a,
                 const float* const* b,
                 std::size_t count,
                 std::size_t n,
                 float* to) {
  HWY_DYNAMIC_DISPATCH(AddProducts)(a, b, count, n, to);
}

void AddToSinks(const Sink* sinks, std::size_t count, const float* r, std::size_t n) {
  HWY_DYNAMIC_DISPATCH(AddToSinks)(sinks, count, r, n);
}

void ExpRow(float most, std::size_t n, float* s) {
  HWY_DYNAMIC_DISPATCH(ExpRow)(most, n, s);
}

void WeightedGram(const double* columns,
                  const double* weight,
                  std::size_t n,
                  std::size_t count,
                  double* gram) {
  std::vector<double> weighted(n);
  for (std::size_t b = 0; b < count; ++b) {
    const double* column = columns + b * n;
    for (std::size_t i = 0; i < n; ++i) {
      weighted[i] = weight[i] * column[i];
    }
    for (std::size_t a = 0; a < b; ++a) {
      gram[b * count + a] = 0;
    }
    for (std::size_t a = b; a < count; a += 4) {
      const double* others[4];
      double products[4];
      for (std::size_t k = 0; k < 4; ++k) {  // the last stands in for those beyond it
        others[k] = columns + (a + k < count ? a + k : count - 1) * n;
      }
      HWY_DYNAMIC_DISPATCH(FourProducts)(weighted.data(), others, n, products);
      for (std::size_t k = 0; k < 4 && a + k < count; ++k) {
        gram[b * count + a + k] = products[k];
      }
    }
  }
}

void AddToSums(const float* values, std::size_t n, double* sums) {
  HWY_DYNAMIC_DISPATCH(AddToSums)(values, n, sums);
}

}  // namespace nacre::factor::internal
#endif

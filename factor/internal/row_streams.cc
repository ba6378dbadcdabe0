#include "factor/internal/row_streams.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

#define NACRE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))

namespace nacre::factor::internal {
namespace {

typedef float Lanes __attribute__((vector_size(64)));
typedef float FewLanes __attribute__((vector_size(16)));
typedef double Doubles __attribute__((vector_size(64)));
constexpr std::size_t kWide = 16;
constexpr std::size_t kFew = 4;
constexpr std::size_t kDoubles = 8;

// From and to any address: the compiler makes one move of it.
[[gnu::always_inline]] inline void Get(const float* from, Lanes& to) {
  std::memcpy(&to, from, sizeof(to));
}
[[gnu::always_inline]] inline void Get(const float* from, FewLanes& to) {
  std::memcpy(&to, from, sizeof(to));
}
[[gnu::always_inline]] inline void Get(const double* from, Doubles& to) {
  std::memcpy(&to, from, sizeof(to));
}
[[gnu::always_inline]] inline void Get(const float* from, float& to) {
  to = *from;
}

// to += r · by
#define NACRE_ADD_TO_SINK(Type, sink, r, i)          \
  {                                                  \
    Type sum;                                        \
    Get((sink).to + (i), sum);                       \
    if ((sink).by != nullptr) {                      \
      Type by;                                       \
      Get((sink).by + (i), by);                      \
      sum += by * (r);                               \
    } else {                                         \
      sum += (sink).weight * (r);                    \
    }                                                \
    std::memcpy((sink).to + (i), &sum, sizeof(sum)); \
  }

}  // namespace

NACRE_CLONES void LinearCombination(const float* const* rows,
                                    const float* weights,
                                    std::size_t count,
                                    float first,
                                    std::size_t n,
                                    float* to) {
  const Lanes none{};
  Lanes v;
  std::size_t i = 0;
  for (; i + 4 * kWide <= n; i += 4 * kWide) {
    Lanes a = none + first;
    Lanes b = a;
    Lanes c = a;
    Lanes d = a;
    for (std::size_t q = 0; q < count; ++q) {
      const float* row = rows[q] + i;
      const float weight = weights[q];
      Get(row, v);
      a += weight * v;
      Get(row + kWide, v);
      b += weight * v;
      Get(row + 2 * kWide, v);
      c += weight * v;
      Get(row + 3 * kWide, v);
      d += weight * v;
    }
    std::memcpy(to + i, &a, sizeof(a));
    std::memcpy(to + i + kWide, &b, sizeof(b));
    std::memcpy(to + i + 2 * kWide, &c, sizeof(c));
    std::memcpy(to + i + 3 * kWide, &d, sizeof(d));
  }
  for (; i < n && n >= kWide; i += kWide) {
    i = std::min(i, n - kWide);  // some at the end once more
    Lanes a = none + first;
    for (std::size_t q = 0; q < count; ++q) {
      Get(rows[q] + i, v);
      a += weights[q] * v;
    }
    std::memcpy(to + i, &a, sizeof(a));
  }
  for (; i < n; ++i) {
    float a = first;
    for (std::size_t q = 0; q < count; ++q) {
      a += weights[q] * rows[q][i];
    }
    to[i] = a;
  }
}

NACRE_CLONES void AddProducts(const float* const* a,
                              const float* const* b,
                              std::size_t count,
                              std::size_t n,
                              float* to) {
  std::size_t i = 0;
  for (; i + kWide <= n; i += kWide) {
    Lanes sum;
    Lanes v;
    Lanes w;
    Get(to + i, sum);
    for (std::size_t q = 0; q < count; ++q) {
      Get(a[q] + i, v);
      Get(b[q] + i, w);
      sum += v * w;
    }
    std::memcpy(to + i, &sum, sizeof(sum));
  }
  for (; i < n; ++i) {
    for (std::size_t q = 0; q < count; ++q) {
      to[i] += a[q][i] * b[q][i];
    }
  }
}

NACRE_CLONES void AddToSinks(const Sink* sinks,
                             std::size_t count,
                             const float* r,
                             std::size_t n) {
  std::size_t i = 0;
  for (; i + 2 * kWide <= n; i += 2 * kWide) {
    Lanes a;
    Lanes b;
    Get(r + i, a);
    Get(r + i + kWide, b);
    for (std::size_t q = 0; q < count; ++q) {
      NACRE_ADD_TO_SINK(Lanes, sinks[q], a, i)
      NACRE_ADD_TO_SINK(Lanes, sinks[q], b, i + kWide)
    }
  }
  for (; i + kFew <= n; i += kFew) {
    FewLanes a;
    Get(r + i, a);
    for (std::size_t q = 0; q < count; ++q) {
      NACRE_ADD_TO_SINK(FewLanes, sinks[q], a, i)
    }
  }
  for (; i < n; ++i) {
    for (std::size_t q = 0; q < count; ++q) {
      NACRE_ADD_TO_SINK(float, sinks[q], r[i], i)
    }
  }
}

// exp x = 2^k exp r, k the nearest whole number to x / ln 2; a minimax polynomial of r.
NACRE_CLONES void ExpRow(float most, std::size_t n, float* s) {
  constexpr float kLeast = -87;
  constexpr float kShift = 12582912;  // 1.5 · 2^23: added, it rounds
  constexpr float kHighLn2 = 0.693359375F;
  constexpr float kLowLn2 = -2.12194440e-4F;
  for (std::size_t i = 0; i < n; ++i) {
    const float x = std::max(std::min(s[i], most), kLeast);
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

// A column with four others at a time.
NACRE_CLONES void WeightedGram(const double* columns,
                               const double* weight,
                               std::size_t n,
                               std::size_t count,
                               double* gram) {
  std::vector<double> weighted(n);
  std::fill_n(gram, count * count, 0.0);
  for (std::size_t b = 0; b < count; ++b) {
    const double* column = columns + b * n;
    for (std::size_t i = 0; i < n; ++i) {
      weighted[i] = weight[i] * column[i];
    }
    for (std::size_t a = b; a < count; a += 4) {
      // The last columns stand in for those beyond them.
      std::array<const double*, 4> other{};
      Doubles sums[4] = {};
      for (std::size_t k = 0; k < 4; ++k) {
        other[k] = columns + std::min(a + k, count - 1) * n;
      }
      std::size_t i = 0;
      for (; i + kDoubles <= n; i += kDoubles) {
        Doubles w;
        Doubles v;
        Get(&weighted[i], w);
        for (std::size_t k = 0; k < 4; ++k) {
          Get(other[k] + i, v);
          sums[k] += w * v;
        }
      }
      for (std::size_t k = 0; k < 4 && a + k < count; ++k) {
        double sum = 0;
        for (std::size_t lane = 0; lane < kDoubles; ++lane) {
          sum += sums[k][lane];
        }
        for (std::size_t rest = i; rest < n; ++rest) {
          sum += weighted[rest] * other[k][rest];
        }
        gram[b * count + a + k] = sum;
      }
    }
  }
}

NACRE_CLONES void AddToSums(const float* values, std::size_t n, double* sums) {
  for (std::size_t i = 0; i < n; ++i) {
    sums[i] += static_cast<double>(values[i]);
  }
}

}  // namespace nacre::factor::internal

#pragma once

#include <cstddef>

namespace nacre::factor::internal {

/// Rows of numbers added up in registers, many rows in one go. The bits are the same
/// whatever the instruction set.

/// to = first + Σ_q weights[q] · rows[q], `count` rows of n values. `to` is none of
/// them.
void LinearCombination(const float* const* rows,
                       const float* weights,
                       std::size_t count,
                       float first,
                       std::size_t n,
                       float* to);

/// to += Σ_q a[q] · b[q], value by value. `to` is none of them.
void AddProducts(const float* const* a,
                 const float* const* b,
                 std::size_t count,
                 std::size_t n,
                 float* to);

/// What a row is added to, times a number, or times a row if `by` isn't null.
struct Sink {
  float* to = nullptr;
  const float* by = nullptr;
  float weight = 0;
};

/// to += r · by (or weight) for each sink. Sinks may overlap each other.
void AddToSinks(const Sink* sinks, std::size_t count, const float* r, std::size_t n);

/// exp(min(s, most)) in place, to 2e-7 of itself; 0 below −87.
void ExpRow(float most, std::size_t n, float* s);

/// gram = Σ_i weight_i a_ia a_ib for columns b ≤ a of `columns` columns of n values
/// each, one after the other; gram: column b from row b on.
void WeightedGram(const double* columns,
                  const double* weight,
                  std::size_t n,
                  std::size_t count,
                  double* gram);

/// sums += values.
void AddToSums(const float* values, std::size_t n, double* sums);

}  // namespace nacre::factor::internal

#pragma once

#include "factor/internal/row_transform.h"

#include <cstdint>
#include <span>

namespace nacre::factor::internal {

/// Columns of a basis that are worked on together: a panel.
inline constexpr std::int64_t kPanel = 16;

/// What rows of `columns` values are padded to, with zeros.
constexpr std::int64_t PaddedColumns(std::int64_t columns) {
  return (columns + kPanel - 1) / kPanel * kPanel;
}

/// Whether floats can hold what TransformFloats works with.
bool FitsFloats(const RowTransform& transform);

/// s of a row's measurements, in floats (to 5e-7 of s), then zeros up to the padded
/// width. Returns Σ s². SIMD by Highway, chosen at run time.
float TransformFloats(const RowTransform& transform,
                      std::span<const float> rd,
                      float* row);

/// The same of a row that is transformed already.
float CopyRow(std::span<const double> values, float* row);

/// Padded rows, `width` apart.
struct RowBlock {
  const float* rows = nullptr;
  std::int64_t count = 0;
  std::int64_t width = 0;
};

/// U = Y V for one panel: `v` is [width][kPanel], `u` [count][kPanel]. Each row's sum
/// runs over the columns in order, so its bits don't depend on the block. Products and
/// sums are fused where the machine can: bits may differ between instruction sets.
void MultiplyPanel(const RowBlock& y, const float* v, float* u);

/// Z += Yᵀ U for one panel: `z` is [width][kPanel]. Sums over the block are floats.
void AddTransposedPanel(const RowBlock& y, const float* u, double* z);

}  // namespace nacre::factor::internal

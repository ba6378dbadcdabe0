#pragma once

#include "factor/internal/row_transform.h"
#include "factor/internal/truncated_svd.h"

#include <cstdint>

namespace nacre::factor::internal {

/// How A and B of a channel are chosen.
struct TransformSearch {
  int terms = 10;
  double peak = 0;        ///< of the whole channel, > 0
  double least = 0;       ///< of the whole channel; below zero where noise goes there
  double log_weight = 0;  ///< 0: the error in R_d alone counts
};

struct TransformChoice {
  RowTransform transform;
  double objective = 0;  ///< relative L2 error + log_weight · rms of ln
  int evaluations = 0;
};

/// Minimises the error that a truncated SVD of ln(R/A + B) makes in R_d on `rd` (rows
/// are filled slices), each row's total being corrected as the material does. Since
/// ln(R/A + B) = ln(R + AB) − ln A, the two numbers are c = AB, which sets what counts
/// as small, and B, which only shifts the matrix; the search takes a coarse grid
/// of c, then golden sections along c and B. Of the c whose error is within 5 % of the
/// least the smallest is taken: that serves the tails. c is at most 100 peaks, where
/// the logarithm has become linear, and at least twice the deepest negative value, so
/// that its argument stays positive.
TransformChoice ChooseTransform(const RowMatrix& rd, const TransformSearch& search);

/// The objective for one transform.
double TransformObjective(const RowMatrix& rd,
                          const RowTransform& transform,
                          const TransformSearch& search);

}  // namespace nacre::factor::internal

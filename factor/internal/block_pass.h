#pragma once

#include "core/progress.h"
#include "factor/internal/slice_source.h"
#include "factor/internal/truncated_svd.h"

#include <functional>
#include <string>
#include <vector>

namespace nacre::factor::internal {

/// Writes a row of a channel's matrix, padded (row_kernels.h), and returns Σ y².
using FillRowFunction = std::function<float(
    const SliceBlock& block, std::int64_t row, std::size_t channel, float* y)>;

/// What one pass over the rows of Y makes of a basis V of k columns: U = Y V and
/// Z = Yᵀ U, from one reading of Y.
struct BlockProduct {
  Eigen::MatrixXd z;     ///< columns × k
  Eigen::MatrixXd gram;  ///< UᵀU
  Eigen::VectorXd sum;   ///< of U's columns
  double squares = 0;    ///< Σ y²
  std::vector<float> u;  ///< [panel][row][kPanel]
};

/// One pass for the matrices of `channels`, with a basis each (all of a whole number of
/// panels). Y is a channel's rows as `fill` makes them. Products are in floats, their
/// sums over blocks of rows in double. Rows always go to the same sums in the same
/// order, so the bits don't depend on the number of threads.
std::vector<BlockProduct> RunBlockPass(SliceSource& source,
                                       const FillRowFunction& fill,
                                       const std::vector<std::size_t>& channels,
                                       const std::vector<Eigen::MatrixXd>& bases,
                                       int thread_count,
                                       const ProgressFunction& progress,
                                       const std::string& note);

}  // namespace nacre::factor::internal

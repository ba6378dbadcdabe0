#pragma once

#include "core/progress.h"
#include "factor/internal/row_lots.h"
#include "factor/internal/slice_source.h"
#include "factor/internal/truncated_svd.h"
#include "factor/internal/workers.h"

#include <functional>
#include <span>
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
  std::vector<float> u;  ///< [panel][row][kPanel]; of other ranks' rows 0
};

/// How ranks share a pass over that many rows.
RowLots PassLots(std::int64_t points);

/// The matrices of a pass: Y is a channel's rows as `fill` makes them; a basis each,
/// all of a whole number of panels.
struct PassMatrices {
  const FillRowFunction& fill;
  const std::vector<std::size_t>& channels;
  const std::vector<Eigen::MatrixXd>& bases;
};

/// One pass over the rows of all matrices. Products are in floats, their
/// sums over blocks of rows in double. Rows always go to the same sums in the same
/// order, so the bits don't depend on the number of threads and ranks.
std::vector<BlockProduct> RunBlockPass(SliceSource& source,
                                       const PassMatrices& y,
                                       const Workers& workers,
                                       const ProgressFunction& progress,
                                       const std::string& note);

}  // namespace nacre::factor::internal

#pragma once

#include "factor/internal/truncated_svd.h"

#include <functional>
#include <vector>

namespace nacre::factor::internal {

/// How TuckerKernels goes about it.
struct TuckerOptions {
  int terms = 10;
  int window_rank = 1;   ///< of a kernel as a core × core matrix; 1: separable
  double least = 1e-12;  ///< of the energy: a term that takes less is rounding
  /// Told of every round of every term: what share of the energy the terms before and
  /// this one take so far.
  std::function<void(int term, double captured)> on_round = nullptr;
};

/// The window sides of a Tucker factorization of the tensor Y [point][v][u], by its
/// Gram matrix alone: YᵀY is all that alternating least squares need, since the best
/// map for a kernel h of norm 1 is f = Y h and the best kernel for that map is Yᵀf =
/// YᵀY h, cut to `window_rank` by its singular value decomposition. Each term has
/// multilinear rank (1, r, r) and is fitted to what the terms before leave, as in
/// [Kurt13], whose terms have r = 1; what they leave is taken after all maps are solved
/// for together, which can only lower the error. Columns are kernels of norm 1, the
/// entry of largest magnitude positive; fewer than asked for if nothing is left. Only
/// the lower triangle of `gram` is read.
Eigen::MatrixXd TuckerKernels(const Eigen::MatrixXd& gram,
                              int core,
                              const TuckerOptions& options);

/// The least-squares coordinates of rows in kernels: coordinates = rows · matrix.
Eigen::MatrixXd CoordinatesOf(const Eigen::MatrixXd& kernels);

}  // namespace nacre::factor::internal

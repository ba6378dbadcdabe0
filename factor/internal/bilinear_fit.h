#pragma once

#include "core/progress.h"
#include "factor/internal/bilinear_data.h"
#include "factor/internal/workers.h"

namespace nacre::factor::internal {

/// The bilinear model while it is being fitted: values ≈ f(x)ᵀ H(d) f(x + d).
struct BilinearFit {
  SharedMaps f;                    ///< uncorrelated over the grid, mean square 1
  std::vector<Eigen::MatrixXd> h;  ///< [channel · cells + cell], of data.scale
  double residual = 0;             ///< √ of the weighted share of squares left
  int rounds = 0;
};

/// Alternating least squares: H given f, an offset at a time over pairs, then f given H
/// and the other points' f, a point at a time, then f is whitened. The second step
/// takes all points at once; with the whitening it is a subspace iteration. The best
/// round is kept. Ranks share offsets and rows of points, all of them holding all
/// pairs; kernels and maps go to all. Terms come in the order of what they contribute,
/// signs canonical.
BilinearFit FitBilinear(const BilinearData& data,
                        const SharedMaps& start,
                        const Workers& workers,
                        const ProgressFunction& progress);

}  // namespace nacre::factor::internal

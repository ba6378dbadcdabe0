#pragma once

#include "factor/internal/reciprocal_fit.h"

namespace nacre::factor::internal {

/// What maps at points can't tell of a pair: Σ_k u_k(p) v_k(c, d), to be added to the
/// logarithm of R_d, p being the pair's first point, d one of the first half of the
/// window's offsets. So it is the same from either end, but the two ends aren't alike.
struct ReciprocalRest {
  SharedMaps u;       ///< a row a term; mean square 1 over the planes, or 0 rows
  Eigen::MatrixXd v;  ///< a column a channel and cell, a row a term
};

/// Probabilistic principal components [Tipping99] of what `fit` leaves of the held
/// pairs, errors weighted as those of R_d are in the fit and pairs that weren't
/// measured left out: expectation maximization from a truncated SVD. The maps are
/// posterior means, which shrinks what noise makes of them. At most `terms`, and no
/// term that stands below the largest singular value of noise alone [Gavish14].
ReciprocalRest FitRest(const ReciprocalData& data,
                       const ReciprocalFit& fit,
                       int terms,
                       int thread_count);

}  // namespace nacre::factor::internal

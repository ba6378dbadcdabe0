#pragma once

#include "reconstruct/internal/kmeans.h"

#include <cstdint>

namespace nacre::reconstruct::internal {

/// How many clusters `points` fall into, 1 to `most`, by the gap statistic
/// [Tibshirani01]: the smallest k whose inertia is as far below that of points spread
/// evenly with the same variances as the next k's is, within a standard error. The axes
/// of the points should be their principal ones.
int ClusterCountByGap(const PointSet& points,
                      int most,
                      std::uint64_t seed,
                      const Workers& workers);

}  // namespace nacre::reconstruct::internal

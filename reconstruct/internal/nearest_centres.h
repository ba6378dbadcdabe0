#pragma once

#include "reconstruct/internal/kmeans.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

struct Nearest {
  int centre = 0;  ///< the first of equals
  float distance2 = 0;
  float second_distance2 = 0;  ///< of the nearest of the others
};

/// Finds the nearest of k centres by computing all k distances at once, sixteen centres
/// to a vector.
class NearestCentres {
 public:
  NearestCentres(const std::vector<double>& centres, int count, int dimensions);

  /// found[m] is what is nearest to points.Row(which[m]).
  void Find(const PointSet& points,
            std::span<const std::int64_t> which,
            std::span<Nearest> found) const;

 private:
  int count_;
  int dimensions_;
  std::vector<float> columns_;  // [sixteen][dimension][centre in it]
};

/// distance2[n] = min(distance2[n], squared distance of point n to `centre`).
void LowerToDistance2(const PointSet& points,
                      const float* centre,
                      std::span<float> distance2);

}  // namespace nacre::reconstruct::internal

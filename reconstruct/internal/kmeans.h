#pragma once

#include <cstdint>
#include <vector>

namespace nacre::reconstruct::internal {

/// Points row by row, `dimensions` values each.
struct PointSet {
  std::vector<float> values;
  std::int64_t count = 0;
  int dimensions = 0;

  const float* Row(std::int64_t n) const {
    return &values[static_cast<std::size_t>(n * dimensions)];
  }
};

struct KMeansResult {
  std::vector<int> labels;
  double inertia = 0;
  int iterations = 0;
  int centre_count = 0;
};

/// Lloyd's iteration until no label changes, from k-means++ seeds drawn from
/// (seed, run). Fewer than k centres come out if fewer than k points differ.
KMeansResult KMeans(const PointSet& points,
                    int k,
                    int max_iterations,
                    std::uint64_t seed,
                    std::uint64_t run);

}  // namespace nacre::reconstruct::internal

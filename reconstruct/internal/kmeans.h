#pragma once

#include <cstdint>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::reconstruct::internal {

/// Points row by row, `dimensions` values each.
struct PointSet {
  std::vector<float> values;
  std::int64_t count = 0;
  int dimensions = 0;

  const float* Row(std::int64_t n) const {
    return &values[static_cast<std::size_t>(n * dimensions)];
  }
  float* Row(std::int64_t n) {
    return &values[static_cast<std::size_t>(n * dimensions)];
  }
};

struct KMeansResult {
  std::vector<int> labels;
  double inertia = 0;  ///< Σ squared distance to the own centre
  int iterations = 0;
  int centre_count = 0;
  std::int64_t distance_count = 0;  ///< point to centre, in all iterations
};

struct KMeansOptions {
  int clusters = 1;
  int max_iterations = 100;
  std::uint64_t seed = 1;
  std::uint64_t run = 0;
  /// Leave out the distances that bounds decide [Hamerly10]. The labels are the same.
  bool use_bounds = true;
};

/// Lloyd's iteration [Lloyd82] until no label changes, from k-means++ seeds [Arthur07]
/// drawn from (seed, run). Fewer than k centres come out if fewer than k points differ.
KMeansResult KMeans(const PointSet& points, const KMeansOptions& options);

/// Who does the work, which doesn't change a bit of the result.
struct Workers {
  int thread_count = 0;
  const Ranks* ranks = nullptr;  ///< collective calls, unless null
};

/// The result of least inertia of `restarts` runs, run side by side.
KMeansResult BestKMeans(const PointSet& points,
                        const KMeansOptions& options,
                        int restarts,
                        const Workers& workers);

}  // namespace nacre::reconstruct::internal

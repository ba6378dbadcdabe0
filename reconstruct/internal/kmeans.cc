#include "reconstruct/internal/kmeans.h"

#include "core/random.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace nacre::reconstruct::internal {
namespace {

double SquaredDistance(const float* a, const double* b, int dimensions) {
  double sum = 0;
  for (int d = 0; d < dimensions; ++d) {
    const double difference = static_cast<double>(a[d]) - b[d];
    sum += difference * difference;
  }
  return sum;
}

using Centres = std::vector<double>;  // row by row, as the points

void AppendCentre(const PointSet& points, std::int64_t n, Centres& centres) {
  centres.insert(centres.end(), points.Row(n), points.Row(n) + points.dimensions);
}

// Each next centre is a point drawn in proportion to its squared distance to the
// nearest centre so far [Arthur07].
Centres Seed(const PointSet& points, int k, RandomStream& random) {
  const auto count = static_cast<std::size_t>(points.count);
  const auto pick =
      static_cast<std::int64_t>(random.Uniform() * static_cast<double>(points.count));
  Centres centres;
  AppendCentre(points, pick, centres);
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  for (int c = 1; c < k; ++c) {
    const double* last =
        &centres[static_cast<std::size_t>((c - 1) * points.dimensions)];
    for (std::size_t n = 0; n < count; ++n) {
      distance[n] = std::min(
          distance[n],
          SquaredDistance(
              points.Row(static_cast<std::int64_t>(n)), last, points.dimensions));
    }
    const double total = std::accumulate(distance.begin(), distance.end(), 0.0);
    if (total <= 0) {
      break;  // all points are centres already
    }
    double left = random.Uniform() * total;
    std::size_t chosen = count;
    for (std::size_t n = 0; n < count && left >= 0; ++n) {
      if (distance[n] > 0) {
        chosen = n;
        left -= distance[n];
      }
    }
    AppendCentre(points, static_cast<std::int64_t>(chosen), centres);
  }
  return centres;
}

// Labels of the nearest centres (the first of equals); true if any changed.
bool Assign(const PointSet& points, const Centres& centres, KMeansResult& result) {
  bool changed = false;
  result.inertia = 0;
  for (std::int64_t n = 0; n < points.count; ++n) {
    int best = 0;
    double best_distance = std::numeric_limits<double>::infinity();
    for (int c = 0; c < result.centre_count; ++c) {
      const double distance =
          SquaredDistance(points.Row(n),
                          &centres[static_cast<std::size_t>(c * points.dimensions)],
                          points.dimensions);
      if (distance < best_distance) {
        best = c;
        best_distance = distance;
      }
    }
    int& label = result.labels[static_cast<std::size_t>(n)];
    changed = changed || label != best;
    label = best;
    result.inertia += best_distance;
  }
  return changed;
}

// Centres to the means of their points; one that lost all of them stays.
void Update(const PointSet& points, const KMeansResult& result, Centres& centres) {
  Centres sums(centres.size(), 0.0);
  std::vector<double> counts(static_cast<std::size_t>(result.centre_count), 0.0);
  for (std::int64_t n = 0; n < points.count; ++n) {
    const int label = result.labels[static_cast<std::size_t>(n)];
    double* sum = &sums[static_cast<std::size_t>(label * points.dimensions)];
    for (int d = 0; d < points.dimensions; ++d) {
      sum[d] += static_cast<double>(points.Row(n)[d]);
    }
    counts[static_cast<std::size_t>(label)] += 1;
  }
  for (std::size_t at = 0; at < centres.size(); ++at) {
    const double count = counts[at / static_cast<std::size_t>(points.dimensions)];
    centres[at] = count > 0 ? sums[at] / count : centres[at];
  }
}

}  // namespace

KMeansResult KMeans(const PointSet& points,
                    int k,
                    int max_iterations,
                    std::uint64_t seed,
                    std::uint64_t run) {
  RandomStream random(seed, run);
  Centres centres = Seed(points, k, random);
  KMeansResult result;
  result.centre_count =
      static_cast<int>(centres.size() / static_cast<std::size_t>(points.dimensions));
  result.labels.assign(static_cast<std::size_t>(points.count), -1);
  while (result.iterations < max_iterations) {
    ++result.iterations;
    if (!Assign(points, centres, result)) {
      break;
    }
    Update(points, result, centres);
  }
  return result;
}

}  // namespace nacre::reconstruct::internal

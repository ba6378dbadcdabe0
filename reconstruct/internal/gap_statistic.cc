#include "reconstruct/internal/gap_statistic.h"

#include "core/parallel.h"
#include "core/random.h"
#include "core/ranks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace nacre::reconstruct::internal {
namespace {

constexpr int kReferences = 6;
constexpr int kRestarts = 4;
constexpr std::int64_t kMostPoints = 1500;
constexpr std::uint64_t kBoxStream = 0x626F7830;  // apart from those of the runs

PointSet Thin(const PointSet& points) {
  PointSet few{{}, std::min(points.count, kMostPoints), points.dimensions};
  for (std::int64_t n = 0; n < few.count; ++n) {
    const float* row = points.Row(n * points.count / few.count);
    few.values.insert(few.values.end(), row, row + points.dimensions);
  }
  return few;
}

// As wide along each axis as gives the points' variance, not their range as in
// [Tibshirani01]: the range of noise grows with the number of points, and would have
// the reference spread along axes that hold noise alone.
PointSet EvenlyAs(const PointSet& points, std::uint64_t seed, std::uint64_t number) {
  RandomStream random(seed, kBoxStream + number);
  PointSet even = points;
  const auto count = static_cast<double>(points.count);
  for (int d = 0; d < points.dimensions; ++d) {
    double sum = 0;
    double square = 0;
    for (std::int64_t n = 0; n < points.count; ++n) {
      const auto value = static_cast<double>(points.Row(n)[d]);
      sum += value / count;
      square += value * value / count;
    }
    const double half = std::sqrt(3 * std::max(0.0, square - sum * sum));
    for (std::int64_t n = 0; n < points.count; ++n) {
      even.Row(n)[d] = static_cast<float>(sum + (2 * random.Uniform() - 1) * half);
    }
  }
  return even;
}

}  // namespace

int ClusterCountByGap(const PointSet& all,
                      int most,
                      std::uint64_t seed,
                      const Workers& workers) {
  const PointSet points = Thin(all);
  most = static_cast<int>(std::min<std::int64_t>(most, points.count - 1));
  // ln of the inertia for k = 1, 2, …, of the points themselves and of the references.
  std::array<std::vector<double>, kReferences + 1> log_inertia;
  bool degenerate = most < 2;
  const RankShare share = ShareOf(kReferences + 1, workers.ranks);
  ParallelFor(share.end - share.begin, workers.thread_count, [&](std::int64_t n) {
    const std::int64_t set = share.begin + n;
    const PointSet one =
        set == 0 ? points : EvenlyAs(points, seed, static_cast<std::uint64_t>(set));
    for (int k = 1; k <= most; ++k) {
      const KMeansResult best = BestKMeans(
          one, {.clusters = k, .seed = seed}, kRestarts, {.thread_count = 1});
      // Nothing is left to explain once points coincide.
      log_inertia[static_cast<std::size_t>(set)].push_back(
          std::log(std::max(best.inertia, 1e-30)));
    }
  });
  if (workers.ranks != nullptr) {
    for (std::size_t set = 0; set < log_inertia.size(); ++set) {
      // Of the ranks but one an empty line.
      for (const std::string& one : workers.ranks->AllGather(
               ToBytes(std::span<const double>(log_inertia[set])))) {
        if (!one.empty()) {
          log_inertia[set] = FromBytes<double>(one);
        }
      }
    }
  }
  degenerate = degenerate || log_inertia[0][0] < std::log(1e-29);
  double last_gap = 0;
  for (int k = 1; k <= most && !degenerate; ++k) {
    const auto at = static_cast<std::size_t>(k - 1);
    double sum = 0;
    double square = 0;
    for (std::size_t r = 1; r <= kReferences; ++r) {
      sum += log_inertia[r][at] / kReferences;
      square += log_inertia[r][at] * log_inertia[r][at] / kReferences;
    }
    const double gap = sum - log_inertia[0][at];
    const double error =
        std::sqrt(std::max(0.0, square - sum * sum) * (1 + 1.0 / kReferences));
    if (k > 1 && last_gap >= gap - error) {
      return k - 1;
    }
    last_gap = gap;
  }
  return degenerate ? 1 : most;
}

}  // namespace nacre::reconstruct::internal

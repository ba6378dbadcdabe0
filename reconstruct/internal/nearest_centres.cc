#include "reconstruct/internal/nearest_centres.h"

#include <algorithm>
#include <limits>

namespace nacre::reconstruct::internal {
namespace {

constexpr int kLanes = 16;

// Where there is no centre: far off, and its square still a float.
constexpr float kNowhere = 1e15F;

__attribute__((target_clones("avx512f", "avx2", "default"))) void Distances2(
    const float* __restrict row,
    const float* __restrict columns,
    int dimensions,
    float* __restrict distance2) {
  float sum[kLanes] = {};
  for (int d = 0; d < dimensions; ++d) {
    const float* column = columns + d * kLanes;
    for (int lane = 0; lane < kLanes; ++lane) {
      const float difference = row[d] - column[lane];
      sum[lane] += difference * difference;
    }
  }
  std::copy(sum, sum + kLanes, distance2);
}

__attribute__((target_clones("avx512f", "avx2", "default"))) float Distance2(
    const float* __restrict a, const float* __restrict b, int dimensions) {
  float sum[kLanes] = {};
  int d = 0;
  for (; d + kLanes <= dimensions; d += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float difference = a[d + lane] - b[d + lane];
      sum[lane] += difference * difference;
    }
  }
  float total = 0;
  for (; d < dimensions; ++d) {
    total += (a[d] - b[d]) * (a[d] - b[d]);
  }
  for (const float part : sum) {
    total += part;
  }
  return total;
}

}  // namespace

NearestCentres::NearestCentres(const std::vector<double>& centres,
                               int count,
                               int dimensions)
    : count_(count), dimensions_(dimensions) {
  const int groups = (count + kLanes - 1) / kLanes;
  columns_.assign(static_cast<std::size_t>(groups * dimensions * kLanes), kNowhere);
  for (int c = 0; c < count; ++c) {
    for (int d = 0; d < dimensions; ++d) {
      columns_[static_cast<std::size_t>((c / kLanes * dimensions + d) * kLanes +
                                        c % kLanes)] =
          static_cast<float>(centres[static_cast<std::size_t>(c * dimensions + d)]);
    }
  }
}

void NearestCentres::Find(const PointSet& points,
                          std::span<const std::int64_t> which,
                          std::span<Nearest> found) const {
  const int groups = (count_ + kLanes - 1) / kLanes;
  std::vector<float> distance2(static_cast<std::size_t>(groups * kLanes));
  for (std::size_t m = 0; m < which.size(); ++m) {
    const float* row = points.Row(which[m]);
    for (int g = 0; g < groups; ++g) {
      Distances2(row,
                 &columns_[static_cast<std::size_t>(g * dimensions_ * kLanes)],
                 dimensions_,
                 &distance2[static_cast<std::size_t>(g * kLanes)]);
    }
    Nearest nearest{0, distance2[0], std::numeric_limits<float>::max()};
    for (int c = 1; c < count_; ++c) {
      const float d2 = distance2[static_cast<std::size_t>(c)];
      if (d2 < nearest.distance2) {
        nearest = {c, d2, nearest.distance2};
      } else {
        nearest.second_distance2 = std::min(nearest.second_distance2, d2);
      }
    }
    found[m] = nearest;
  }
}

void LowerToDistance2(const PointSet& points,
                      const float* centre,
                      std::span<float> distance2) {
  for (std::int64_t n = 0; n < points.count; ++n) {
    float& least = distance2[static_cast<std::size_t>(n)];
    least = std::min(least, Distance2(points.Row(n), centre, points.dimensions));
  }
}

}  // namespace nacre::reconstruct::internal

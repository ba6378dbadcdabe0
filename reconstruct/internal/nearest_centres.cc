#include "reconstruct/internal/nearest_centres.h"

#include "core/simd_clones.h"
#include "reconstruct/internal/lanes.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace nacre::reconstruct::internal {
namespace {

// Where there is no centre: far off, and its square still a float.
constexpr float kNowhere = 1e15F;

// Points taken together, so that a sum needn't wait for the one before it.
constexpr int kPointsAtOnce = 4;
using Rows = std::array<const float*, kPointsAtOnce>;

// Of each point to sixteen centres.
NACRE_SIMD_CLONES void Distances2(const Rows& rows,
                                  const float* __restrict columns,
                                  int dimensions,
                                  std::array<float*, kPointsAtOnce> distance2) {
  Lanes sum[kPointsAtOnce] = {};
  for (int d = 0; d < dimensions; ++d) {
    Lanes column;
    std::memcpy(&column, columns + d * kLanes, sizeof column);
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kPointsAtOnce; ++n) {
      const Lanes difference = rows[n][d] - column;
      sum[n] += difference * difference;
    }
  }
  for (std::size_t n = 0; n < kPointsAtOnce; ++n) {
    std::memcpy(distance2[n], &sum[n], sizeof sum[n]);
  }
}

NACRE_SIMD_CLONES float Distance2(const float* __restrict a,
                                  const float* __restrict b,
                                  int dimensions) {
  Lanes sum = {};
  int d = 0;
  for (; d + kLanes <= dimensions; d += kLanes) {
    Lanes left;
    Lanes right;
    std::memcpy(&left, a + d, sizeof left);
    std::memcpy(&right, b + d, sizeof right);
    sum += (left - right) * (left - right);
  }
  float total = 0;
  for (; d < dimensions; ++d) {
    total += (a[d] - b[d]) * (a[d] - b[d]);
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    total += sum[lane];
  }
  return total;
}

}  // namespace

NearestCentres::NearestCentres(const std::vector<double>& centres,
                               int count,
                               int dimensions)
    : count_(count), dimensions_(dimensions) {
  const int groups = (count + kLanes - 1) / kLanes;
  columns_.assign(static_cast<std::size_t>(std::int64_t{groups} * dimensions * kLanes),
                  kNowhere);
  for (int c = 0; c < count; ++c) {
    for (int d = 0; d < dimensions; ++d) {
      columns_[static_cast<std::size_t>(
          (std::int64_t{c / kLanes} * dimensions + d) * kLanes + c % kLanes)] =
          static_cast<float>(
              centres[static_cast<std::size_t>(std::int64_t{c} * dimensions + d)]);
    }
  }
}

namespace {

Nearest NearestOf(std::span<const float> distance2) {
  Nearest nearest{0, distance2[0], std::numeric_limits<float>::max()};
  for (std::size_t c = 1; c < distance2.size(); ++c) {
    if (distance2[c] < nearest.distance2) {
      nearest = {static_cast<int>(c), distance2[c], nearest.distance2};
    } else {
      nearest.second_distance2 = std::min(nearest.second_distance2, distance2[c]);
    }
  }
  return nearest;
}

}  // namespace

void NearestCentres::Find(const PointSet& points,
                          std::span<const std::int64_t> which,
                          std::span<Nearest> found) const {
  const int groups = (count_ + kLanes - 1) / kLanes;
  const auto stride = static_cast<std::size_t>(std::int64_t{groups} * kLanes);
  std::vector<float> distance2(kPointsAtOnce * stride);
  for (std::size_t first = 0; first < which.size(); first += kPointsAtOnce) {
    const std::size_t count =
        std::min<std::size_t>(kPointsAtOnce, which.size() - first);
    Rows rows;
    for (std::size_t n = 0; n < kPointsAtOnce; ++n) {
      rows[n] = points.Row(which[first + std::min(n, count - 1)]);
    }
    for (int g = 0; g < groups; ++g) {
      std::array<float*, kPointsAtOnce> out;
      for (std::size_t n = 0; n < kPointsAtOnce; ++n) {
        out[n] = &distance2[n * stride + static_cast<std::size_t>(g * kLanes)];
      }
      Distances2(
          rows,
          &columns_[static_cast<std::size_t>(std::int64_t{g} * dimensions_ * kLanes)],
          dimensions_,
          out);
    }
    for (std::size_t n = 0; n < count; ++n) {
      found[first + n] = NearestOf(
          std::span(distance2).subspan(n * stride, static_cast<std::size_t>(count_)));
    }
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

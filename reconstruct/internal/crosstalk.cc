#include "reconstruct/internal/crosstalk.h"

#include "core/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace nacre::reconstruct::internal {
namespace {

// At its rim a window may hold as much of the neighbours' light as of its own.
constexpr double kUnspoilt = 0.8;

std::vector<int> GroupsOf(const RdHeader& header, const acquire::Schedule& schedule) {
  std::vector<int> groups(static_cast<std::size_t>(header.PointCount()));
  for (int group = 0; group < schedule.group_count(); ++group) {
    for (const acquire::GridIndex& spot : schedule.Group(group)) {
      groups[static_cast<std::size_t>(std::int64_t{spot.j} * header.points_x +
                                      spot.i)] = group;
    }
  }
  return groups;
}

}  // namespace

Crosstalk::Crosstalk(const RdHeader& header,
                     const acquire::Schedule& schedule,
                     const SliceSpool& raw,
                     const std::vector<OutsideCell>& outside,
                     int thread_count)
    : header_(header),
      schedule_(schedule),
      raw_(raw),
      thread_count_(thread_count),
      group_of_(GroupsOf(header, schedule)),
      tails_(header) {
  FitTails(kUnspoilt, /*clean=*/false);
  FitFalloff(outside);
  FitTails(1.0, /*clean=*/true);
  FitFalloff(outside);
}

void Crosstalk::FitTails(double outer, bool clean) {
  TailMap fitted(header_);
  ParallelFor(header_.PointCount(), thread_count_, [&](std::int64_t s) {
    fitted.Fit(static_cast<int>(s % header_.points_x),
               static_cast<int>(s / header_.points_x),
               clean ? Clean(s) : raw_.Fetch(s),
               outer);
  });
  tails_ = std::move(fitted);
}

namespace {

constexpr std::size_t kNodeCount = TailMap::kNodes.size();
using Nodes = std::array<double, kNodeCount>;

// What one cell outside the windows says: Σ_n falloff_n · light_n = seen.
struct FalloffRow {
  Nodes light{};  ///< extrapolated, by way of each node
  double all = 0;
  double seen = 0;
  double variance = 0;
  std::size_t nearest = 0;  ///< the node that most of it goes by
};

// Adds what the tails' own spread makes of a row's trustworthiness. Within a distance
// it is in proportion to the light, so that the fit gets the sum of the light right: to
// weigh relative errors would trust tails that are too faint the most.
void AddModelVariance(std::vector<FalloffRow>& rows) {
  constexpr double kSpread = 0.1;
  Nodes sum{};
  Nodes count{};
  for (const FalloffRow& row : rows) {
    sum[row.nearest] += row.all;
    count[row.nearest] += 1;
  }
  for (FalloffRow& row : rows) {
    row.variance += kSpread * kSpread * row.all * sum[row.nearest] / count[row.nearest];
  }
}

// Non-negative least squares by multiplicative steps [Lee01], which leave a node alone
// that no row tells of.
Nodes SolveFalloff(const std::vector<FalloffRow>& rows) {
  constexpr int kSteps = 200;
  Nodes falloff;
  falloff.fill(1);
  for (int step = 0; step < kSteps; ++step) {
    Nodes seen{};
    Nodes predicted{};
    for (const FalloffRow& row : rows) {
      const double sum =
          std::inner_product(falloff.begin(), falloff.end(), row.light.begin(), 0.0);
      for (std::size_t n = 0; n < kNodeCount; ++n) {
        seen[n] += row.light[n] * row.seen / row.variance;
        predicted[n] += row.light[n] * sum / row.variance;
      }
    }
    for (std::size_t n = 0; n < kNodeCount; ++n) {
      falloff[n] *= predicted[n] > 0 ? std::max(0.0, seen[n]) / predicted[n] : 1;
    }
  }
  return falloff;
}

}  // namespace

void Crosstalk::FitFalloff(const std::vector<OutsideCell>& outside) {
  const int radius = header_.Radius();
  for (int c = 0; c < static_cast<int>(header_.channels.size()); ++c) {
    tails_.SetFalloff(c, {1, 1, 1, 1, 1});
    std::vector<FalloffRow> rows;
    for (const OutsideCell& cell : outside) {
      if (cell.channel != c) {
        continue;
      }
      FalloffRow row;
      row.seen = static_cast<double>(cell.rd);
      row.variance = std::pow(static_cast<double>(cell.sigma), 2);
      for (const acquire::GridIndex& spot : schedule_.Group(cell.group)) {
        const int du = cell.column - radius - spot.i;
        const int dv = cell.row - radius - spot.j;
        const auto light =
            static_cast<double>(tails_.Extrapolate(spot.i, spot.j, c, du, dv));
        const TailMap::Place place = tails_.PlaceOf(du, dv);
        const auto node = static_cast<std::size_t>(place.node);
        const auto second = static_cast<double>(place.second);
        row.light[node] += (1 - second) * light;
        row.light[node + 1] += second * light;
        row.all += light;
      }
      row.nearest = static_cast<std::size_t>(
          std::max_element(row.light.begin(), row.light.end()) - row.light.begin());
      if (row.all > 0) {
        rows.push_back(row);
      }
    }
    AddModelVariance(rows);
    const Nodes falloff = SolveFalloff(rows);
    TailMap::Falloff rounded{};
    std::transform(falloff.begin(), falloff.end(), rounded.begin(), [](double value) {
      return static_cast<float>(value);
    });
    tails_.SetFalloff(c, rounded);
  }
}

RdSlice Crosstalk::Clean(std::int64_t s, double* share) const {
  RdSlice slice = raw_.Fetch(s);
  const int i = static_cast<int>(s % header_.points_x);
  const int j = static_cast<int>(s / header_.points_x);
  const int radius = header_.Radius();
  std::size_t at = 0;
  for (int c = 0; c < static_cast<int>(header_.channels.size()); ++c) {
    double total = 0;
    double taken = 0;
    const std::size_t begin = at;
    for (const acquire::GridIndex& other :
         schedule_.Group(group_of_[static_cast<std::size_t>(s)])) {
      const int du = i - other.i;
      const int dv = j - other.j;
      if ((du == 0 && dv == 0) ||
          std::max(std::abs(du), std::abs(dv)) > tails_.Reach() + radius) {
        continue;
      }
      at = begin;
      for (int v = -radius; v <= radius; ++v) {
        for (int u = -radius; u <= radius; ++u, ++at) {
          const float foreign = tails_.Extrapolate(other.i, other.j, c, du + u, dv + v);
          taken += static_cast<double>(slice.valid[at] != 0 ? foreign : 0.0F);
          slice.rd[at] -= slice.valid[at] != 0 ? foreign : 0.0F;
        }
      }
    }
    at = begin + static_cast<std::size_t>(header_.WindowSize());
    for (std::size_t k = begin; k < at; ++k) {
      total += static_cast<double>(slice.rd[k]);
    }
    if (share != nullptr && total > 0) {
      *share = std::max(*share, taken / total);
    }
  }
  return slice;
}

}  // namespace nacre::reconstruct::internal

#include "reconstruct/internal/separation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace nacre::reconstruct::internal {

// A picture's spots enter at slightly different angles; for tails the first one's
// factor is good enough for all.
std::vector<Separation::Outside> Separation::SampleOutside() const {
  // So many tell enough, however large the session is; they are all in memory.
  constexpr std::int64_t kSamplesInAll = 12288;
  const std::int64_t samples =
      std::clamp<std::int64_t>(kSamplesInAll / schedule_.group_count(), 16, 256);
  std::vector<Outside> outside;
  outside.reserve(
      static_cast<std::size_t>(samples * schedule_.group_count() * channels_));
  for (int group = 0; group < schedule_.group_count(); ++group) {
    if (!spool_.Holds(group)) {
      continue;
    }
    const auto spots = schedule_.Group(group);
    const std::int64_t first = std::int64_t{spots[0].j} * header_.points_x + spots[0].i;
    const auto is_outside = [&](int column, int row) {
      return std::none_of(
          spots.begin(), spots.end(), [&](const acquire::GridIndex& spot) {
            return column >= spot.i && column < spot.i + header_.core &&
                   row >= spot.j && row < spot.j + header_.core;
          });
    };
    // A stride prime to the lattice's width walks through all columns and rows.
    std::int64_t stride = std::max<std::int64_t>(1, lattice_.CellCount() / samples);
    while (std::gcd(stride, std::int64_t{lattice_.columns}) != 1) {
      ++stride;
    }
    for (std::int64_t cell = group % stride; cell < lattice_.CellCount();
         cell += stride) {
      const int column = static_cast<int>(cell % lattice_.columns);
      const int row = static_cast<int>(cell / lattice_.columns);
      if (!is_outside(column, row)) {
        continue;
      }
      for (int c = 0; c < channels_; ++c) {
        const auto at = static_cast<std::size_t>(c * lattice_.CellCount() + cell);
        const float sigma = spool_.Sigma(group)[at];
        if (sigma >= 0) {
          const float enter = EnterFactor(first, c);
          outside.push_back(
              {group, c, column, row, spool_.Rd(group)[at] * enter, sigma * enter});
        }
      }
    }
  }
  return outside;
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
  Nodes seen{};
  std::array<Nodes, kNodeCount> gram{};
  for (const FalloffRow& row : rows) {
    for (std::size_t n = 0; n < kNodeCount; ++n) {
      seen[n] += row.light[n] * row.seen / row.variance;
      for (std::size_t m = 0; m < kNodeCount; ++m) {
        gram[n][m] += row.light[n] * row.light[m] / row.variance;
      }
    }
  }
  Nodes falloff;
  falloff.fill(1);
  for (int step = 0; step < kSteps; ++step) {
    Nodes predicted{};
    for (std::size_t n = 0; n < kNodeCount; ++n) {
      predicted[n] =
          std::inner_product(falloff.begin(), falloff.end(), gram[n].begin(), 0.0);
    }
    // At a window's rim tails are what was fitted there.
    for (std::size_t n = 1; n < kNodeCount; ++n) {
      falloff[n] *= predicted[n] > 0 ? std::max(0.0, seen[n]) / predicted[n] : 1;
    }
  }
  return falloff;
}

}  // namespace

void Separation::FitFalloff(const std::vector<Outside>& outside) {
  const int radius = header_.Radius();
  for (int c = 0; c < channels_; ++c) {
    tails_.SetFalloff(c, {1, 1, 1, 1, 1});
    std::vector<FalloffRow> rows;
    rows.reserve(outside.size() / static_cast<std::size_t>(channels_));
    for (const Outside& cell : outside) {
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

}  // namespace nacre::reconstruct::internal

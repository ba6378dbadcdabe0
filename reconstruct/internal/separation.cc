#include "reconstruct/internal/separation.h"

#include "core/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace nacre::reconstruct::internal {
namespace {

// At its rim a window may hold as much of the neighbours' light as of its own.
constexpr double kUnspoilt = 0.8;

// Of a window's half width: nearer to its spot tails aren't a prior.
constexpr double kInner = 0.55;

constexpr float kFirstSpread = 0.2F;
constexpr float kLeastSpread = 0.02F;

std::vector<int> GroupsOf(const RdHeader& header, const acquire::Schedule& schedule) {
  std::vector<int> groups(static_cast<std::size_t>(header.PointCount()), 0);
  for (int group = 0; group < schedule.group_count(); ++group) {
    for (const acquire::GridIndex& spot : schedule.Group(group)) {
      groups[static_cast<std::size_t>(std::int64_t{spot.j} * header.points_x +
                                      spot.i)] = group;
    }
  }
  return groups;
}

// The least distance of two spots of a group along an axis, in cells.
int SpacingOf(const RdHeader& header, const acquire::Schedule& schedule) {
  int spacing = 3 * header.core;
  for (const acquire::GridIndex& a : schedule.Group(0)) {
    for (const acquire::GridIndex& b : schedule.Group(0)) {
      const int apart = std::max(std::abs(a.i - b.i), std::abs(a.j - b.j));
      spacing = apart > 0 ? std::min(spacing, apart) : spacing;
    }
  }
  return spacing;
}

}  // namespace

struct Separation::Outside {
  int group;
  int channel;
  int column;
  int row;
  float rd;
  float sigma;
};

Separation::Separation(const RdHeader& header,
                       const acquire::Schedule& schedule,
                       const GroupReader& reader,
                       const GroupSpool& spool,
                       int thread_count)
    : header_(header),
      schedule_(schedule),
      spool_(spool),
      lattice_(header),
      channels_(static_cast<int>(header.channels.size())),
      thread_count_(thread_count),
      group_of_(GroupsOf(header, schedule)),
      lit_(reader.LitPoints()),
      tails_(header),
      spread_(header.channels.size(), kFirstSpread) {
  const int spacing = SpacingOf(header, schedule);
  is_dense_ = spacing < header.core;
  spacing_ = spacing / (header.Radius() + 0.5);
  for (std::int64_t s = 0; s < header.PointCount(); ++s) {
    for (int c = 0; c < channels_; ++c) {
      enter_factor_.push_back(static_cast<float>(
          reader.EnterFactor(group_of_[static_cast<std::size_t>(s)],
                             c,
                             static_cast<int>(s % header.points_x),
                             static_cast<int>(s / header.points_x))));
    }
  }
}

// Between which nodes a cell lies, and how near to the second.
struct Separation::Node {
  int first;
  int next;
  float second;
};

Separation::Node Separation::NodeOf(int u) const {
  constexpr int kStep = 4;
  if (is_dense_) {
    return {u, u, 0.0F};
  }
  const int first = u / kStep * kStep;
  const int next = std::min(first + kStep, header_.core - 1);
  const float second =
      next > first ? static_cast<float>(u - first) / static_cast<float>(next - first)
                   : 0.0F;
  return {first, next, second};
}

Separation::Foreign Separation::Mix(const Foreign& a, const Foreign& b, float second) {
  return {std::lerp(a.light, b.light, second),
          std::lerp(a.variance, b.variance, second),
          a.hides};
}

Separation::Foreign Separation::ForeignAt(std::int64_t s,
                                          int channel,
                                          int u,
                                          int v) const {
  const int radius = header_.Radius();
  const int i = static_cast<int>(s % header_.points_x);
  const int j = static_cast<int>(s / header_.points_x);
  const float spread = spread_[static_cast<std::size_t>(channel)];
  const double inner2 = std::pow(kInner * (radius + 0.5), 2);
  Foreign foreign;
  for (const acquire::GridIndex& other :
       schedule_.Group(group_of_[static_cast<std::size_t>(s)])) {
    const int du = i - other.i + u - radius;
    const int dv = j - other.j + v - radius;
    if ((other.i == i && other.j == j) ||
        std::max(std::abs(du), std::abs(dv)) > tails_.Reach()) {
      continue;
    }
    const float light = tails_.Extrapolate(other.i, other.j, channel, du, dv);
    foreign.light += light;
    foreign.variance += spread * light * spread * light;
    foreign.hides = foreign.hides || du * du + dv * dv < inner2;
  }
  return foreign;
}

Separation::Value Separation::ValueOf(
    std::int64_t s, int channel, int u, int v, const Foreign& other) const {
  const int i = static_cast<int>(s % header_.points_x);
  const int j = static_cast<int>(s / header_.points_x);
  const int group = group_of_[static_cast<std::size_t>(s)];
  const auto at = static_cast<std::size_t>(channel * lattice_.CellCount() +
                                           lattice_.Index(i + u, j + v));
  const float noise = spool_.Sigma(group)[at];
  if (noise < 0) {
    return {};
  }
  const float enter = EnterFactor(s, channel);
  const float seen = spool_.Rd(group)[at] * enter;
  const float noise2 = noise * enter * noise * enter;
  if (!has_tails_) {
    return {seen, noise2, 0};
  }
  const int du = u - header_.Radius();
  const int dv = v - header_.Radius();
  const bool is_inner =
      du * du + dv * dv < std::pow(kInner * (header_.Radius() + 0.5), 2);
  const float own = is_inner ? 0.0F : tails_.Extrapolate(i, j, channel, du, dv);
  if (!(own > 0)) {
    return {seen - other.light, noise2 + other.variance, other.light};
  }
  const float spread = spread_[static_cast<std::size_t>(channel)];
  const float own2 = spread * own * spread * own;
  if (other.hides) {
    return {own, own2, seen - own};
  }
  const float rest2 = other.variance + noise2;
  const float rd = own + own2 / (own2 + rest2) * (seen - own - other.light);
  return {rd, own2 * rest2 / (own2 + rest2), seen - rd};
}

Separation::Value Separation::At(std::int64_t s, int channel, int u, int v) const {
  const auto slot = static_cast<std::size_t>(s);
  if (!lit_[slot] || !spool_.Holds(group_of_[slot])) {
    return {};
  }
  if (!has_tails_) {
    return ValueOf(s, channel, u, v, {});
  }
  if (is_dense_) {
    return ValueOf(s, channel, u, v, ForeignAt(s, channel, u, v));
  }
  const Node x = NodeOf(u);
  const Node y = NodeOf(v);
  const auto row = [&](int at) {
    return Mix(ForeignAt(s, channel, x.first, at),
               ForeignAt(s, channel, x.next, at),
               x.second);
  };
  return ValueOf(s, channel, u, v, Mix(row(y.first), row(y.next), y.second));
}

RdSlice Separation::Slice(std::int64_t s, double* share) const {
  RdSlice slice = MakeSlice(header_);
  const auto slot = static_cast<std::size_t>(s);
  if (!lit_[slot] || !spool_.Holds(group_of_[slot])) {
    std::fill(slice.valid.begin(), slice.valid.end(), std::uint8_t{0});
    return slice;
  }
  const int core = header_.core;
  std::vector<Foreign> nodes(static_cast<std::size_t>(core * core));
  const auto node = [&](int u, int v) -> Foreign& {
    return nodes[static_cast<std::size_t>(v * core + u)];
  };
  std::size_t at = 0;
  for (int c = 0; c < channels_; ++c) {
    for (int v = 0; has_tails_ && v < core;
         v = v + 1 < core ? NodeOf(v + 1).next : core) {
      for (int u = 0; u < core; u = u + 1 < core ? NodeOf(u + 1).next : core) {
        node(u, v) = ForeignAt(s, c, u, v);
      }
    }
    double total = 0;
    double taken = 0;
    for (int v = 0; v < core; ++v) {
      const Node y = NodeOf(v);
      for (int u = 0; u < core; ++u, ++at) {
        const Node x = NodeOf(u);
        const auto row = [&](int line) {
          return Mix(node(x.first, line), node(x.next, line), x.second);
        };
        const Value value =
            ValueOf(s, c, u, v, Mix(row(y.first), row(y.next), y.second));
        slice.valid[at] = value.variance < 0 ? 0 : 1;
        slice.rd[at] = value.rd;
        slice.sigma[at] = value.variance < 0 ? 0.0F : std::sqrt(value.variance);
        total += static_cast<double>(value.rd);
        taken += static_cast<double>(value.foreign);
      }
    }
    if (share != nullptr && total > 0) {
      *share = std::max(*share, taken / total);
    }
  }
  return slice;
}

void Separation::FitTails() {
  const std::vector<Outside> outside = SampleOutside();
  // Half way to the next spot both shine alike.
  FitSlices(std::min(kUnspoilt, 0.5 * spacing_));
  FitFalloff(outside);
  has_tails_ = true;
  const int rounds = is_dense_ ? 3 : 1;
  for (int round = 0; round < rounds; ++round) {
    MeasureSpread();
    FitSlices(1.0);
    FitFalloff(outside);
  }
  MeasureSpread();
}

void Separation::FitSlices(double outer) {
  TailMap fitted(header_);
  ParallelForBlocks(header_.PointCount(), 16, thread_count_, [&](auto begin, auto end) {
    for (std::int64_t s = begin; s < end; ++s) {
      fitted.Fit(static_cast<int>(s % header_.points_x),
                 static_cast<int>(s / header_.points_x),
                 Slice(s),
                 outer);
    }
  });
  tails_ = std::move(fitted);
}

// How far tails are from what is seen where little of it is of other spots: between the
// inner part and where the next spot begins to matter.
void Separation::MeasureSpread() {
  constexpr std::int64_t kSlices = 400;
  const std::int64_t count = std::min(kSlices, header_.PointCount());
  const int radius = header_.Radius();
  const double outer = std::min(kUnspoilt, 0.45 * spacing_) * (radius + 0.5);
  std::vector<double> sums(static_cast<std::size_t>(count * channels_ * 2), 0.0);
  ParallelFor(count, thread_count_, [&](std::int64_t n) {
    const std::int64_t s = n * header_.PointCount() / count;
    for (int c = 0; c < channels_; ++c) {
      const auto at = static_cast<std::size_t>((n * channels_ + c) * 2);
      for (int v = 0; v < header_.core; ++v) {
        for (int u = 0; u < header_.core; ++u) {
          const double r = std::hypot(u - radius, v - radius);
          if (r < kInner * (radius + 0.5) || r > outer) {
            continue;
          }
          const int group = group_of_[static_cast<std::size_t>(s)];
          const int i = static_cast<int>(s % header_.points_x);
          const int j = static_cast<int>(s / header_.points_x);
          const float own = tails_.Extrapolate(i, j, c, u - radius, v - radius);
          const Value value = At(s, c, u, v);
          if (value.variance < 0 || !(own > 0)) {
            continue;
          }
          const auto cell = static_cast<std::size_t>(c * lattice_.CellCount() +
                                                     lattice_.Index(i + u, j + v));
          const float enter = EnterFactor(s, c);
          const auto noise = static_cast<double>(spool_.Sigma(group)[cell] * enter);
          const auto foreign = static_cast<double>(value.foreign);
          const auto seen = static_cast<double>(spool_.Rd(group)[cell] * enter);
          const double off = seen - foreign - static_cast<double>(own);
          sums[at] += off * off - noise * noise;
          sums[at + 1] += static_cast<double>(own) * static_cast<double>(own);
        }
      }
    }
  });
  for (int c = 0; c < channels_; ++c) {
    double off2 = 0;
    double own2 = 0;
    for (std::int64_t n = 0; n < count; ++n) {
      const auto at = static_cast<std::size_t>((n * channels_ + c) * 2);
      off2 += sums[at];
      own2 += sums[at + 1];
    }
    spread_[static_cast<std::size_t>(c)] =
        own2 > 0 ? std::max(kLeastSpread,
                            static_cast<float>(std::sqrt(std::max(0.0, off2 / own2))))
                 : kFirstSpread;
  }
}

// A picture's spots enter at slightly different angles; for tails the first one's
// factor is good enough for all.
std::vector<Separation::Outside> Separation::SampleOutside() const {
  std::vector<Outside> outside;
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
    constexpr std::int64_t kSamples = 256;
    std::int64_t stride = std::max<std::int64_t>(1, lattice_.CellCount() / kSamples);
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

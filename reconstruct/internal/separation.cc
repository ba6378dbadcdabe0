#include "reconstruct/internal/separation.h"

#include "core/parallel.h"
#include "core/ranks.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// At its rim a window may hold as much of the neighbours' light as of its own.
constexpr double kUnspoilt = 0.8;

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

Separation::Separation(const RdHeader& header,
                       const acquire::Schedule& schedule,
                       const GroupReader& reader,
                       const GroupSpool& spool,
                       const ReconstructOptions& options)
    : header_(header),
      schedule_(schedule),
      spool_(spool),
      lattice_(header),
      channels_(static_cast<int>(header.channels.size())),
      thread_count_(options.thread_count),
      ranks_(options.ranks),
      group_of_(GroupsOf(header, schedule)),
      lit_(reader.LitPoints()),
      tails_(header),
      spread_(header.channels.size()) {
  const int spacing = SpacingOf(header, schedule);
  is_dense_ = spacing < header.core;
  spacing_ = spacing / (header.Radius() + 0.5);
  for (Spreads& rings : spread_) {
    rings.fill(kFirstSpread);
  }
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
  const int first = u / kStep * kStep;
  const int next = std::min(first + kStep, header_.core - 1);
  const float second =
      next > first ? static_cast<float>(u - first) / static_cast<float>(next - first)
                   : 0.0F;
  return {first, next, second};
}

Separation::Foreign Separation::Mix(const Foreign& a, const Foreign& b, float second) {
  const auto t = static_cast<double>(second);
  return {std::lerp(a.light, b.light, second),
          std::lerp(a.variance, b.variance, t),
          std::lerp(a.square, b.square, t),
          a.hides};
}

Separation::Foreign Separation::Sum(const Foreign& a, const Foreign& b) {
  return {a.light + b.light,
          a.variance + b.variance,
          a.square + b.square,
          a.hides || b.hides};
}

Separation::Others Separation::OthersOf(std::int64_t s) const {
  const int i = static_cast<int>(s % header_.points_x);
  const int j = static_cast<int>(s / header_.points_x);
  const int nearby = 2 * header_.core;
  Others others;
  for (const acquire::GridIndex& spot :
       schedule_.Group(group_of_[static_cast<std::size_t>(s)])) {
    const int apart = std::max(std::abs(spot.i - i), std::abs(spot.j - j));
    if (apart > 0 && apart <= tails_.Reach() + header_.Radius()) {
      (apart <= nearby ? others.near : others.far).push_back(spot);
    }
  }
  return others;
}

Separation::Foreign Separation::ForeignAt(
    Spots others, std::int64_t s, int channel, int u, int v) const {
  const int radius = header_.Radius();
  const int i = static_cast<int>(s % header_.points_x);
  const int j = static_cast<int>(s / header_.points_x);
  const double inner2 = std::pow(kInner * (radius + 0.5), 2);
  Foreign foreign;
  for (const acquire::GridIndex& other : others) {
    const int du = i - other.i + u - radius;
    const int dv = j - other.j + v - radius;
    if (std::max(std::abs(du), std::abs(dv)) > tails_.Reach()) {
      continue;
    }
    const float light = tails_.Extrapolate(other.i, other.j, channel, du, dv);
    const auto wide = static_cast<double>(light);
    const double off = static_cast<double>(SpreadAt(channel, du, dv)) * wide;
    foreign.light += light;
    foreign.square += wide * wide;
    foreign.variance += off * off;
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
  const double noise2 = std::pow(static_cast<double>(noise * enter), 2);
  if (!has_tails_) {
    return {seen, noise2, 0};
  }
  const int du = u - header_.Radius();
  const int dv = v - header_.Radius();
  const bool is_inner =
      du * du + dv * dv < std::pow(kInner * (header_.Radius() + 0.5), 2);
  // Where windows don't overlap what is seen is better than any prior: tails are nearly
  // never off by as little as noise.
  const float own =
      is_inner || !is_dense_ ? 0.0F : tails_.Extrapolate(i, j, channel, du, dv);
  if (!(own > 0)) {
    return {seen - other.light, noise2 + other.variance, other.light};
  }
  const auto own_off = static_cast<double>(SpreadAt(channel, du, dv) * own);
  const double own2 = own_off * own_off;
  if (other.hides) {
    return {own, own2, seen - own};
  }
  const double rest2 = other.variance + noise2;
  const double share = own2 / (own2 + rest2);
  const float rd = own + static_cast<float>(share) * (seen - own - other.light);
  return {rd, share * rest2, seen - rd};
}

Separation::Value Separation::At(std::int64_t s, int channel, int u, int v) const {
  const auto slot = static_cast<std::size_t>(s);
  if (!lit_[slot] || !spool_.Holds(group_of_[slot])) {
    return {};
  }
  if (!has_tails_) {
    return ValueOf(s, channel, u, v, {});
  }
  const Others others = OthersOf(s);
  const Node x = NodeOf(u);
  const Node y = NodeOf(v);
  const auto row = [&](int at) {
    return Mix(ForeignAt(others.far, s, channel, x.first, at),
               ForeignAt(others.far, s, channel, x.next, at),
               x.second);
  };
  return ValueOf(s,
                 channel,
                 u,
                 v,
                 Sum(ForeignAt(others.near, s, channel, u, v),
                     Mix(row(y.first), row(y.next), y.second)));
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
    return nodes[static_cast<std::size_t>(std::int64_t{v} * core + u)];
  };
  const Others others = has_tails_ ? OthersOf(s) : Others{};
  std::size_t at = 0;
  for (int c = 0; c < channels_; ++c) {
    for (int v = 0; has_tails_ && v < core;
         v = v + 1 < core ? NodeOf(v + 1).next : core) {
      for (int u = 0; u < core; u = u + 1 < core ? NodeOf(u + 1).next : core) {
        node(u, v) = ForeignAt(others.far, s, c, u, v);
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
        const Value value = ValueOf(s,
                                    c,
                                    u,
                                    v,
                                    Sum(ForeignAt(others.near, s, c, u, v),
                                        Mix(row(y.first), row(y.next), y.second)));
        slice.valid[at] = value.variance < 0 ? 0 : 1;
        slice.rd[at] = value.rd;
        slice.sigma[at] =
            value.variance < 0 ? 0.0F : static_cast<float>(std::sqrt(value.variance));
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
  const RankShare share = ShareOf(header_.PointCount(), ranks_);
  const std::int64_t own = share.end - share.begin;
  ParallelForBlocks(own, 16, thread_count_, [&](auto begin, auto end) {
    for (std::int64_t s = share.begin + begin; s < share.begin + end; ++s) {
      fitted.Fit(static_cast<int>(s % header_.points_x),
                 static_cast<int>(s / header_.points_x),
                 Slice(s),
                 outer);
    }
  });
  fitted.Join(ranks_);
  tails_ = std::move(fitted);
}

}  // namespace nacre::reconstruct::internal

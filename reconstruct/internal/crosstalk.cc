#include "reconstruct/internal/crosstalk.h"

#include "core/parallel.h"

#include <algorithm>

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
                     int thread_count)
    : header_(header),
      schedule_(schedule),
      raw_(raw),
      thread_count_(thread_count),
      group_of_(GroupsOf(header, schedule)),
      tails_(header) {
  FitTails(kUnspoilt, /*clean=*/false);
  FitTails(1.0, /*clean=*/true);
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

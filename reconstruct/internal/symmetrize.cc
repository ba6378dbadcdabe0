#include "reconstruct/internal/symmetrize.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {

void SymmetrizeChange::Add(const SymmetrizeChange& other) {
  changed += other.changed;
  all += other.all;
  worst_total = std::max(worst_total, other.worst_total);
}

SymmetrizeChange Symmetrize(const RdHeader& header,
                            const Separation& separation,
                            std::int64_t s,
                            RdSlice& slice) {
  SymmetrizeChange change;
  const int i = static_cast<int>(s % header.points_x);
  const int j = static_cast<int>(s / header.points_x);
  const int last = header.core - 1;
  std::size_t at = 0;
  for (int c = 0; c < static_cast<int>(header.channels.size()); ++c) {
    double before = 0;
    double difference = 0;
    for (int v = 0; v < header.core; ++v) {
      for (int u = 0; u < header.core; ++u, ++at) {
        const int to_i = i + u - header.Radius();
        const int to_j = j + v - header.Radius();
        before += static_cast<double>(slice.rd[at]);
        if (slice.valid[at] == 0 || to_i < 0 || to_i >= header.points_x || to_j < 0 ||
            to_j >= header.points_y || (to_i == i && to_j == j)) {
          continue;
        }
        const Separation::Value back = separation.At(
            std::int64_t{to_j} * header.points_x + to_i, c, last - u, last - v);
        const double variance = std::pow(static_cast<double>(slice.sigma[at]), 2);
        if (back.variance < 0 || !(variance + back.variance > 0)) {
          continue;
        }
        const double weight = variance / (variance + back.variance);
        const float step = static_cast<float>(weight) * (back.rd - slice.rd[at]);
        slice.rd[at] += step;
        slice.sigma[at] = static_cast<float>(std::sqrt(weight * back.variance));
        difference += static_cast<double>(step);
        change.changed += static_cast<double>(std::abs(step));
      }
    }
    change.all += before;
    if (before > 0) {
      change.worst_total = std::max(change.worst_total, std::abs(difference) / before);
    }
  }
  return change;
}

}  // namespace nacre::reconstruct::internal

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "reconstruct/internal/separation.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {

int Separation::RingOf(double cells) const {
  constexpr double kWide = 0.15;  // half widths of a window
  const double at = (cells / (header_.Radius() + 0.5) - kInner) / kWide;
  return static_cast<int>(std::clamp(at, 0.0, kSpreadRings - 1.0));
}

float Separation::SpreadAt(int channel, int du, int dv) const {
  return spread_[static_cast<std::size_t>(channel)]
                [static_cast<std::size_t>(RingOf(std::hypot(du, dv)))];
}

// How far tails are from what is seen: of M − Σ T_j, which isn't a result but what
// goes into one, less noise, over Σ T_j². Cells weigh as much as they tell of a
// relative spread.
void Separation::MeasureSpread() {
  constexpr float kLeastSpread = 0.02F;
  constexpr std::int64_t kSlices = 400;
  constexpr double kTypical = 0.1;
  const std::int64_t count = std::min(kSlices, header_.PointCount());
  const int radius = header_.Radius();
  struct Sum {
    double off2 = 0;
    double light2 = 0;
  };
  using Sums = std::array<Sum, kSpreadRings>;
  std::vector<Sums> sums(static_cast<std::size_t>(count * channels_));
  const RankShare share = ShareOf(count * channels_, ranks_);
  ParallelFor(share.end - share.begin, thread_count_, [&](std::int64_t k) {
    const std::int64_t n = share.begin + k;
    const std::int64_t s = n / channels_ * header_.PointCount() / count;
    const int c = static_cast<int>(n % channels_);
    const auto slot = static_cast<std::size_t>(s);
    const int group = group_of_[slot];
    if (!lit_[slot] || !spool_.Holds(group)) {
      return;
    }
    const int i = static_cast<int>(s % header_.points_x);
    const int j = static_cast<int>(s / header_.points_x);
    const auto enter = static_cast<double>(EnterFactor(s, c));
    Others others = OthersOf(s);
    others.near.insert(others.near.end(), others.far.begin(), others.far.end());
    for (int v = 0; v < header_.core; ++v) {
      for (int u = 0; u < header_.core; ++u) {
        const double r = std::hypot(u - radius, v - radius);
        const auto own =
            static_cast<double>(tails_.Extrapolate(i, j, c, u - radius, v - radius));
        const auto cell = static_cast<std::size_t>(c * lattice_.CellCount() +
                                                   lattice_.Index(i + u, j + v));
        const auto noise = static_cast<double>(spool_.Sigma(group)[cell]) * enter;
        if (r < kInner * (radius + 0.5) || noise < 0 || !(own > 0)) {
          continue;
        }
        const Foreign other = ForeignAt(others.near, s, c, u, v);
        if (other.hides) {
          continue;
        }
        const double off = static_cast<double>(spool_.Rd(group)[cell]) * enter - own -
                           static_cast<double>(other.light);
        const double light2 = own * own + other.square;
        const double weight =
            1 / std::pow(noise * noise + kTypical * kTypical * light2, 2);
        Sum& sum =
            sums[static_cast<std::size_t>(n)][static_cast<std::size_t>(RingOf(r))];
        sum.off2 += weight * light2 * (off * off - noise * noise);
        sum.light2 += weight * light2 * light2;
      }
    }
  });
  JoinShares(count * channels_, ranks_, std::span(sums));
  for (int c = 0; c < channels_; ++c) {
    float last = kFirstSpread;
    for (std::size_t ring = 0; ring < kSpreadRings; ++ring) {
      Sum all;
      for (std::int64_t n = c; n < count * channels_; n += channels_) {
        all.off2 += sums[static_cast<std::size_t>(n)][ring].off2;
        all.light2 += sums[static_cast<std::size_t>(n)][ring].light2;
      }
      if (all.light2 > 0) {
        last = std::max(
            kLeastSpread,
            static_cast<float>(std::sqrt(std::max(0.0, all.off2 / all.light2))));
      }
      spread_[static_cast<std::size_t>(c)][ring] = last;
    }
  }
}

}  // namespace nacre::reconstruct::internal

#include "reconstruct/internal/tails.h"

#include "core/rank_shares.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nacre::reconstruct::internal {
namespace {

// Tails are fitted from here outwards, as a share of the window's half width: the
// exponential form doesn't hold nearer to the light.
constexpr double kInner = 0.45;
constexpr int kRings = 4;

// A ring counts if it stands that far out of the noise, and weighs no more than one
// known to that precision: the form of the tail is no better.
constexpr double kMinSignal = 3;
constexpr double kBestPrecision = 0.05;

struct Ring {
  double r_sum_mm = 0;
  double value_sum = 0;  // of r² R_d
  double variance_sum = 0;
  double count = 0;
};

TailMap::Place PlaceAt(double half_widths) {
  const auto& nodes = TailMap::kNodes;
  const double at = std::clamp(half_widths, nodes.front(), nodes.back());
  std::size_t n = 0;
  while (n + 2 < nodes.size() && at >= nodes[n + 1]) {
    ++n;
  }
  return {static_cast<int>(n),
          static_cast<float>((at - nodes[n]) / (nodes[n + 1] - nodes[n]))};
}

}  // namespace

TailMap::TailMap(const RdHeader& header)
    : header_(header),
      channels_(static_cast<int>(header.channels.size())),
      reach_(3 * header.core),
      tails_(static_cast<std::size_t>(header.PointCount() * channels_ * kSectors)),
      falloff_(static_cast<std::size_t>(channels_), Falloff{1, 1, 1, 1, 1}) {
  const double half_width_mm = (header.Radius() + 0.5) * header.pitch_mm;
  for (int dv = -reach_; dv <= reach_; ++dv) {
    for (int du = -reach_; du <= reach_; ++du) {
      const double r_mm = std::hypot(du, dv) * header.pitch_mm;
      const double turn = std::atan2(-dv, du) / (2 * std::numbers::pi);
      const int sector = static_cast<int>(std::lround(turn * kSectors) + kSectors);
      ways_.push_back({static_cast<float>(r_mm),
                       static_cast<float>(r_mm > 0 ? 2 * std::log(r_mm) : 0.0),
                       sector % kSectors,
                       PlaceAt(r_mm / half_width_mm)});
    }
  }
}

void TailMap::Fit(int i, int j, const RdSlice& slice, double outer) {
  const double outer_mm = outer * (header_.Radius() + 0.5) * header_.pitch_mm;
  for (int c = 0; c < channels_; ++c) {
    for (int sector = 0; sector < kSectors; ++sector) {
      const auto index = static_cast<std::size_t>(
          ((std::int64_t{j} * header_.points_x + i) * channels_ + c) * kSectors +
          sector);
      tails_[index] = FitSector(slice, c, sector, outer_mm);
    }
  }
}

void TailMap::Join(const Ranks* ranks) {
  JoinShares(header_.PointCount(), ranks, std::span(tails_));
}

// Least squares of ln(r² R_d) = a + slope · r over rings, whose means are far enough
// from the noise for their logarithms to be unbiased.
TailMap::Tail TailMap::FitSector(const RdSlice& slice,
                                 int channel,
                                 int sector,
                                 double outer_mm) const {
  const double inner_mm = kInner * (header_.Radius() + 0.5) * header_.pitch_mm;
  std::array<Ring, kRings> rings;
  auto k = static_cast<std::size_t>(channel * header_.WindowSize());
  for (int v = 0; v < header_.core; ++v) {
    for (int u = 0; u < header_.core; ++u, ++k) {
      const Way& way = WayTo(u - header_.Radius(), v - header_.Radius());
      const auto r = static_cast<double>(way.r_mm);
      const double place = (r - inner_mm) / (outer_mm - inner_mm) * kRings;
      if (way.sector != sector || place < 0 || place >= kRings || slice.valid[k] == 0) {
        continue;
      }
      Ring& ring = rings[static_cast<std::size_t>(place)];
      ring.r_sum_mm += r;
      ring.value_sum += r * r * static_cast<double>(slice.rd[k]);
      ring.variance_sum += std::pow(r * r * static_cast<double>(slice.sigma[k]), 2);
      ring.count += 1;
    }
  }
  double weights = 0;
  double x = 0;
  double y = 0;
  double xx = 0;
  double xy = 0;
  int used = 0;
  for (const Ring& ring : rings) {
    const double noise = std::sqrt(ring.variance_sum);
    if (ring.count == 0 || !(ring.value_sum > kMinSignal * noise)) {
      continue;
    }
    const double precision = std::max(noise / ring.value_sum, kBestPrecision);
    const double weight = 1 / (precision * precision);
    const double r = ring.r_sum_mm / ring.count;
    const double log_value = std::log(ring.value_sum / ring.count);
    weights += weight;
    x += weight * r;
    y += weight * log_value;
    xx += weight * r * r;
    xy += weight * r * log_value;
    ++used;
  }
  const double determinant = weights * xx - x * x;
  if (used < 2 || !(determinant > 0)) {
    return {};
  }
  // A tail that doesn't fall would be noise, or light from elsewhere.
  const double slope = std::min(0.0, (weights * xy - x * y) / determinant);
  const double a = (y - slope * x) / weights;
  return {static_cast<float>(a), static_cast<float>(slope), true};
}

float TailMap::Extrapolate(int i, int j, int channel, int du, int dv) const {
  if (std::abs(du) > reach_ || std::abs(dv) > reach_) {
    return 0;
  }
  const Way& way = WayTo(du, dv);
  const Tail& there = At(i, j, channel, way.sector);
  // Cells outside the grid are taken to be like the nearest point of it.
  const Tail& back = At(std::clamp(i + du, 0, header_.points_x - 1),
                        std::clamp(j + dv, 0, header_.points_y - 1),
                        channel,
                        (way.sector + kSectors / 2) % kSectors);
  if (!there.known && !back.known) {
    return 0;
  }
  const float there_log = there.log_r2_rd + there.slope_per_mm * way.r_mm;
  const float back_log = back.log_r2_rd + back.slope_per_mm * way.r_mm;
  const float log_r2_rd = !back.known    ? there_log
                          : !there.known ? back_log
                                         : 0.5F * (there_log + back_log);
  const Falloff& falloff = falloff_[static_cast<std::size_t>(channel)];
  const auto node = static_cast<std::size_t>(way.place.node);
  return std::exp(log_r2_rd - way.log_r2) *
         std::lerp(falloff[node], falloff[node + 1], way.place.second);
}

TailMap::Place TailMap::PlaceOf(int du, int dv) const {
  return std::abs(du) > reach_ || std::abs(dv) > reach_ ? Place{} : WayTo(du, dv).place;
}

}  // namespace nacre::reconstruct::internal

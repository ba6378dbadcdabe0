#include "factor/internal/row_scans.h"

#include "core/simd_clones.h"
#include "factor/internal/block_pass.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr std::size_t kLanes = 16;

struct RowScan {
  float low, high;
  double total;
};

// Sixteen of each, so that operations don't wait for each other. A NaN is in the total.
NACRE_SIMD_CLONES RowScan ScanValues(const float* rd, std::size_t count) {
  std::array<float, kLanes> low;
  std::array<float, kLanes> high;
  std::array<double, kLanes> total{};
  low.fill(rd[0]);
  high.fill(rd[0]);
  std::size_t at = 0;
  for (; at + kLanes <= count; at += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float value = rd[at + k];
      low[k] = value < low[k] ? value : low[k];
      high[k] = value > high[k] ? value : high[k];
      total[k] += static_cast<double>(value);
    }
  }
  for (; at < count; ++at) {
    low[0] = rd[at] < low[0] ? rd[at] : low[0];
    high[0] = rd[at] > high[0] ? rd[at] : high[0];
    total[0] += static_cast<double>(rd[at]);
  }
  RowScan scan{low[0], high[0], 0};
  for (std::size_t k = 0; k < kLanes; ++k) {
    scan.low = std::min(scan.low, low[k]);
    scan.high = std::max(scan.high, high[k]);
    scan.total += total[k];
  }
  return scan;
}

}  // namespace

RowScans::RowScans(std::size_t channels, std::int64_t point_count)
    : points(point_count),
      low(channels * static_cast<std::size_t>(point_count), 0.0F),
      high(low.size(), 0.0F),
      total(low.size(), 0.0) {}

void RowScans::Add(std::size_t channel, std::int64_t point, std::span<const float> rd) {
  const RowScan scan = ScanValues(rd.data(), rd.size());
  const std::size_t at =
      channel * static_cast<std::size_t>(points) + static_cast<std::size_t>(point);
  low[at] = scan.low;
  high[at] = scan.high;
  total[at] = scan.total;
}

void RowScans::Join(const Ranks* ranks) {
  if (ranks == nullptr) {
    return;
  }
  const auto count = static_cast<std::size_t>(points);
  const RowLots lots = PassLots(points);
  for (std::size_t begin = 0; begin < low.size(); begin += count) {
    lots.Join(ranks, std::span<float>(low).subspan(begin, count));
    lots.Join(ranks, std::span<float>(high).subspan(begin, count));
    lots.Join(ranks, std::span<double>(total).subspan(begin, count));
  }
  std::int64_t missing[] = {has_missing ? 1 : 0};
  ranks->Sum(missing);
  has_missing = missing[0] > 0;
}

bool RowScans::AreRegular(std::size_t channel, double least) const {
  const auto first = static_cast<std::int64_t>(channel) * points;
  return !has_missing &&
         std::all_of(total.begin() + first,
                     total.begin() + first + points,
                     [](double value) { return std::isfinite(value); }) &&
         static_cast<double>(*std::min_element(low.begin() + first,
                                               low.begin() + first + points)) > least;
}

void RowScans::Store(std::size_t channel,
                     std::int64_t window,
                     ChannelScan& scan) const {
  const auto first = static_cast<std::int64_t>(channel) * points;
  const auto last = first + points;
  scan.peak =
      static_cast<double>(*std::max_element(high.begin() + first, high.begin() + last));
  scan.least =
      static_cast<double>(*std::min_element(low.begin() + first, low.begin() + last));
  scan.sum = 0;
  for (std::int64_t n = first; n < last; ++n) {
    scan.sum += total[static_cast<std::size_t>(n)];
  }
  scan.used = points * window;
}

}  // namespace nacre::factor::internal

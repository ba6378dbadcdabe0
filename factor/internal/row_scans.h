#pragma once

#include "core/ranks.h"
#include "factor/internal/mean_slice.h"

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

namespace nacre::factor::internal {

/// What a pass that reads rows for something else tells of them beside,
/// [channel][point].
struct RowScans {
  RowScans(std::size_t channels, std::int64_t points);

  /// From any thread, each row once a pass.
  void Add(std::size_t channel, std::int64_t point, std::span<const float> rd);

  /// Collective: rows that other ranks' parts of a pass saw are here too.
  void Join(const Ranks* ranks);

  /// Whether all values seen are finite and above `least`, and none was missing.
  bool AreRegular(std::size_t channel, double least) const;

  /// Extremes and sum as Scan() finds them; the mean slice stays.
  void Store(std::size_t channel, std::int64_t window, ChannelScan& scan) const;

  std::int64_t points = 0;
  std::vector<float> low;
  std::vector<float> high;
  std::vector<double> total;
  std::atomic<bool> has_missing{false};
};

}  // namespace nacre::factor::internal

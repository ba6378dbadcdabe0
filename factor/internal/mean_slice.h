#pragma once

#include "factor/internal/slice_source.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::factor::internal {

/// What one pass over a channel tells, invalid cells left out.
struct ChannelScan {
  double peak = 0;           ///< largest R_d
  double least = 0;          ///< smallest R_d; negative where noise goes below zero
  double sum = 0;            ///< Σ R_d
  std::int64_t used = 0;     ///< valid values
  std::vector<double> mean;  ///< the average slice; cells never valid take their ring's
  std::vector<double> falloff;  ///< what a fit divides slices by; empty: nothing
};

/// G(d) [Peers06; Oenel14, eq. 4.2]: the mean slice over its largest value, but no less
/// than noise comes to, which the depth of the lowest value below zero tells, or than
/// kLogFloor. Positive.
std::vector<double> MeanFalloff(const ChannelScan& scan);

/// Scans all channels. Throws BadData naming slice, channel and cell of the first value
/// that isn't finite, and for a channel without one valid value.
std::vector<ChannelScan> Scan(SliceSource& source, int thread_count);

/// Writes the row's values to `filled`, with invalid ones replaced by the mean slice
/// scaled to the row's valid part: the starting point, which RowBasis then refines.
/// Returns the number of invalid values.
int FillRow(std::span<const float> rd,
            std::span<const std::uint8_t> valid,
            const ChannelScan& scan,
            std::span<double> filled);

/// Rows (slices) that are read and worked on at a time. Sums are formed a block at a
/// time, so this is part of what makes results independent of the thread count.
inline constexpr std::int64_t kBlockRows = 512;

}  // namespace nacre::factor::internal

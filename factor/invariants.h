#pragma once

#include "core/json_fwd.h"
#include "factor/material.h"

#include <cstdint>
#include <string>

namespace nacre::factor {

/// What has to hold of every material, as measured: R_d ≥ 0 and finite, no slice gives
/// more than came in, R_d(a → b) = R_d(b → a). The first two and the last on a sample
/// of the slices, energy on all of them.
struct Invariants {
  std::int64_t slices = 0;  ///< windows looked at, all channels
  double least = 0;         ///< smallest R_d in these, mm⁻²
  double largest = 0;       ///< largest R_d in these, mm⁻²

  double largest_total = 0;    ///< albedo of a slice and channel
  std::int64_t above_one = 0;  ///< slices and channels with an albedo above kMostTotal
  int largest_total_i = 0;
  int largest_total_j = 0;
  std::string largest_total_channel;

  std::int64_t pairs = 0;  ///< of points, with channels, compared both ways
  /// Root mean square of (a − b) / mean of both, of pairs above 10⁻⁵ of the largest.
  double asymmetry = 0;

  /// Rounding of maps and totals is no violation: an albedo is kept as a half float.
  static constexpr double kMostTotal = 1.001;

  std::string Brief() const;  ///< one line
  /// What a person should do about energy above 1; empty if there is none.
  std::string EnergyNote() const;
  Json ToJson() const;
};

/// At most 64 slices are evaluated, and 64 pairs of each: linear in the window,
/// whatever the grid. The same material and seed give the same bits for any number of
/// threads. Throws BadData naming point, channel and cell of an R_d that isn't finite
/// or is negative.
Invariants CheckInvariants(const Material& material,
                           std::uint64_t seed = 1,
                           int thread_count = 0);

}  // namespace nacre::factor

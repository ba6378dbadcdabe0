#pragma once

#include "acquire/schedule.h"

#include <vector>

namespace nacre::acquire {

/// What the preview of a sample (all pictures of the first group of spots) says of the
/// rest of it. In session.json once it is known, so that a resumed capture goes on by
/// the same plan.
struct AdaptivePlan {
  /// A channel: how many of [camera] exposures_us, from the longest, are left out since
  /// they show no pixel that the next shorter one doesn't.
  std::vector<int> omitted_exposures;
  /// Grid points around which nothing scatters; not lit.
  std::vector<GridIndex> empty_points;

  friend bool operator==(const AdaptivePlan&, const AdaptivePlan&) = default;
};

}  // namespace nacre::acquire

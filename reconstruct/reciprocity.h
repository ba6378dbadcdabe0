#pragma once

#include "reconstruct/rd_dataset.h"

#include <cstdint>

namespace nacre::reconstruct {

/// How far R_d(a, b) and R_d(b, a) are apart. A rig lights at normal incidence and sees
/// all directions that come out, so that they aren't exactly alike in a material that
/// varies; and what is systematically wrong with one isn't with the other.
struct ReciprocityFigures {
  std::int64_t pair_count = 0;
  double difference = 0;  ///< rms of (a − b) / mean of both
  double noise = 0;       ///< what sigma makes of it
  double asymmetry = 0;   ///< what is left without noise: √(difference² − noise²)
};

/// From at most `slices` slices, spread over the grid, and 12 pairs of each in which
/// both values are valid, on the grid and above three sigma.
ReciprocityFigures MeasureReciprocity(RdReader& reader,
                                      std::int64_t slices = 32,
                                      std::uint64_t seed = 1);

}  // namespace nacre::reconstruct

#pragma once

#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <span>

namespace nacre::reconstruct::internal {

/// Marks as not valid what lies below the glare's floor: cells whose value, as the mean
/// of what is valid in the 3 × 3 around them, is less than `floor`, the standard
/// deviation of what glare leaves there. The mean, since a cell's own noise would keep
/// those that it raised. Returns how many were marked.
std::int64_t MarkBelowFloor(const RdHeader& header,
                            std::span<const float> floor,
                            RdSlice& slice);

}  // namespace nacre::reconstruct::internal

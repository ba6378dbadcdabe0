#pragma once

namespace nacre::reconstruct::internal {

/// Sixteen floats, as many registers as the machine needs for them. Sums in an array of
/// floats would be kept in memory, and each would wait for the one before it.
constexpr int kLanes = 16;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

}  // namespace nacre::reconstruct::internal

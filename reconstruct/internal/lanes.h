#pragma once

#include <cstring>

namespace nacre::reconstruct::internal {

/// Sixteen floats, as many registers as the machine needs for them. Sums in an array of
/// floats would be kept in memory, and each would wait for the one before it.
constexpr int kLanes = 16;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

/// In pairs, pairs of pairs, …: one after another each addition would wait for the
/// last.
[[gnu::always_inline]] inline float SumOf(const Lanes& lanes) {
  using Eight = float __attribute__((vector_size(8 * sizeof(float))));
  using Four = float __attribute__((vector_size(4 * sizeof(float))));
  Eight halves[2];
  std::memcpy(halves, &lanes, sizeof lanes);
  const Eight eight = halves[0] + halves[1];
  Four quarters[2];
  std::memcpy(quarters, &eight, sizeof eight);
  const Four four = quarters[0] + quarters[1];
  return (four[0] + four[2]) + (four[1] + four[3]);
}

}  // namespace nacre::reconstruct::internal

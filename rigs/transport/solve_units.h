#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::rigs {

/// Among whom work is shared.
struct UnitSharing {
  const Ranks* ranks = nullptr;  ///< null: this process alone
  int thread_count = 0;          ///< of each rank; 0: all cores
  std::int64_t at_once = 128;    ///< units in memory, more if there are more threads
};

/// Solves units 0 … count − 1, each on one thread of one rank, which takes every n-th
/// of them. `use` gets what `solve` made of each, in the units' order, at the root
/// alone: so that sums made there have the same bits for any number of ranks and
/// threads. All ranks must call this with the same count.
void SolveUnits(
    const UnitSharing& sharing,
    std::int64_t count,
    const std::function<std::vector<float>(std::int64_t unit)>& solve,
    const std::function<void(std::int64_t unit, std::span<const float> values)>& use);

}  // namespace nacre::rigs

#pragma once

#include <cstdint>
#include <functional>

namespace nacre {

/// Threads that `requested` stands for: 0 means all cores.
int ThreadCount(int requested);

/// Calls body(i) for every i in [0, count), on `thread_count` threads (0: all cores).
/// The order is unspecified; for results that don't depend on it, write to element i
/// only and reduce afterwards in index order. The first exception stops the loop and is
/// rethrown.
void ParallelFor(std::int64_t count,
                 int thread_count,
                 const std::function<void(std::int64_t)>& body);

/// As ParallelFor, with body(begin, end) called on blocks of at most `block` indices.
/// The blocks depend on `count` and `block` alone, never on the number of threads.
void ParallelForBlocks(std::int64_t count,
                       std::int64_t block,
                       int thread_count,
                       const std::function<void(std::int64_t, std::int64_t)>& body);

}  // namespace nacre

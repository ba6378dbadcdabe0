#pragma once

#include "core/progress.h"
#include "rigs/transport/transport.h"

#include <cstdint>
#include <functional>

namespace nacre::rigs {

struct GridSummary {
  std::int64_t points = 0;
  std::int64_t distinct = 0;  ///< of them, up to the pattern's symmetries: those solved
};

/// The windows of all points of the phantom's grid, each distinct one solved once.
/// `use(i, j, window)` is called for every point, one call at a time, in no particular
/// order. In memory: what the solver needs, few windows, and 8 bytes a point. Of
/// solvers with noise, images of one window have the same noise. Throws Interrupted.
GridSummary SolveGrid(const Transport& transport,
                      const std::function<void(int i, int j, Window&& window)>& use,
                      const ProgressFunction& progress = {});

}  // namespace nacre::rigs

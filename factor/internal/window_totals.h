#pragma once

#include "factor/material.h"

#include <cstdint>
#include <vector>

namespace nacre::factor::internal {

/// Σ_d R_d of points [first, first + count) of a channel of a kSum material without
/// clusters, as EvaluateTerms has it but in floats, to a few 1e-7 of the largest
/// values. SIMD by Highway, chosen at run time.
void WindowTotals(const Material& m,
                  int channel,
                  std::int64_t first,
                  std::int64_t count,
                  double* totals);

}  // namespace nacre::factor::internal

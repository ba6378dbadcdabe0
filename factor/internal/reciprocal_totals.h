#pragma once

#include "factor/internal/method.h"

namespace nacre::factor::internal {

/// Sets row_scale of a reciprocal material so that totals of slices over their measured
/// cells are within `bound` of the measured ones, as a fraction: slices that are beyond
/// it are moved to it, the others stay as they are as far as their neighbours let them.
/// One factor a point, applied at both ends, keeps reciprocity; it is found as a fixed
/// point and rounded to steps of a quarter of the bound at most, which the material's
/// own becomes if it has steps. Slices without a positive total stay. One pass, or
/// none where the job knows the measured totals.
void BalanceTotals(Job& job, double bound, Material& material);

}  // namespace nacre::factor::internal

#pragma once

#include "reconstruct/rd_dataset.h"

namespace nacre::reconstruct::internal {

/// Marks the cells within `radius_cells` of the lit point as not measured, where what
/// the surface itself reflects is seen beside what comes out of it, and fills them from
/// outside: ln R_d = a + b r by least squares over the ring 2.5 cells wide around them.
/// sigma there is that of a guess: the ring's scatter around the line, and all that the
/// line rises by from the ring's middle on. A channel whose ring isn't all positive is
/// left marked and 0.
void FillDiagonal(const RdHeader& header, double radius_cells, RdSlice& slice);

}  // namespace nacre::reconstruct::internal

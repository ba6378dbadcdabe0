#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/rd_dataset.h"

namespace nacre::reconstruct::internal {

/// Adds to sigma, in quadrature, what the calibration doesn't know: the flux scale and
/// a spot's power ripple, in proportion to the value, and where the spot really was, in
/// proportion to the slope of ln R_d. Those errors are common to neighbouring cells.
void AddSystematics(const RdHeader& header,
                    const calibrate::Calibration& calibration,
                    RdSlice& slice);

}  // namespace nacre::reconstruct::internal

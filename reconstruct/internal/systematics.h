#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/rd_dataset.h"

namespace nacre::reconstruct::internal {

/// Adds to sigma, in quadrature, what the calibration doesn't know: flux scale, flat
/// field, a spot's power ripple and speckle, in proportion to the value, and where the
/// spot really was, in proportion to the slope of ln R_d. Those errors are common to
/// neighbouring cells. And what a cell's pixels of one row have in common in noise,
/// at the longest exposure.
void AddSystematics(const RdHeader& header,
                    const calibrate::Calibration& calibration,
                    double longest_us,
                    RdSlice& slice);

}  // namespace nacre::reconstruct::internal

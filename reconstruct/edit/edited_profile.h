#pragma once

#include "reconstruct/edit/edit.h"

namespace nacre::reconstruct {

/// One channel's profile of a point: core × core values of R_d, all ≥ 0.
using Profile = std::vector<float>;

/// A slice's channel with cells that weren't measured, or are below 1e-7 of the peak
/// (noise), filled by the mean of their ring (of the positive cells in it; else that of
/// the ring before).
Profile FilledProfile(const RdHeader& header, const RdSlice& slice, int channel);

/// As wide by `range`, its total kept: (1/s²) R(d/s) averaged over each cell in 4 × 4
/// places, ln R interpolated between cells; beyond the window it falls as the two
/// outermost rings do.
Profile Stretched(const RdHeader& header, const Profile& profile, double range);

/// R^shape, its total kept.
Profile Reshaped(const Profile& profile, double shape);

}  // namespace nacre::reconstruct

#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"

namespace nacre::reconstruct::internal {

/// Standard deviation in mm, along an axis, of a laser spot as the camera sees it on
/// the reference target: the beam's width and the lens' blur together. Half the second
/// moment of each spot of the lattice, less that of a pixel; the median over spots and
/// channels. Throws BadData if no spot stands out.
double MeasureSpotSigmaMm(const acquire::SessionReader& session,
                          const calibrate::Calibration& calibration);

/// The spot's moments as calibrated, the mean of the channels' (one set of weights
/// serves all); without them a round spot of that width.
calibrate::SpotProfile SpotOf(const acquire::SessionReader& session,
                              const calibrate::Calibration& calibration);

}  // namespace nacre::reconstruct::internal

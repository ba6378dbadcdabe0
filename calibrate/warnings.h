#pragma once

#include "calibrate/calibration.h"

#include <vector>

namespace nacre::calibrate {

/// What a warning needs to know beside the calibration.
struct WarningFacts {
  double flat_residual = 0;
  double flat_noise = 0;
  SmoothField reference_ambient;
  int missed_spots = 0;
  double pitch_mm = 1;
  double longest_exposure_us = 0;
};

/// What a user of that rig should know: each is corrected as far as its text says. The
/// names and what they mean are listed in docs/twin-defects.md.
std::vector<Warning> WarningsOf(const Calibration& calibration,
                                const WarningFacts& facts);

}  // namespace nacre::calibrate

#pragma once

#include "acquire/illuminator.h"

namespace nacre::acquire {

/// The angles that a laser DAC of 12 bits can ask a scanner for: step 0 is
/// −max_angle_rad, step 4095 is +max_angle_rad, the same along both axes.
struct ScanField {
  static constexpr int kLastStep = 4095;
  double max_angle_rad = 0;  ///< optical, at full deflection

  /// The nearest step, within the field.
  int StepFromAngle(double angle_rad) const;
  double AngleFromStep(int step) const;
  /// The angle that is reached when this one is asked for.
  ScanAngle Snap(ScanAngle angle) const;
};

}  // namespace nacre::acquire

#include "acquire/scan_field.h"

#include <algorithm>
#include <cmath>

namespace nacre::acquire {

int ScanField::StepFromAngle(double angle_rad) const {
  const double step = (angle_rad / max_angle_rad + 1) * (0.5 * kLastStep);
  return static_cast<int>(std::lround(std::clamp(step, 0.0, double{kLastStep})));
}

double ScanField::AngleFromStep(int step) const {
  return (2.0 * step / kLastStep - 1) * max_angle_rad;
}

ScanAngle ScanField::Snap(ScanAngle angle) const {
  return {AngleFromStep(StepFromAngle(angle.x_rad)),
          AngleFromStep(StepFromAngle(angle.y_rad))};
}

}  // namespace nacre::acquire

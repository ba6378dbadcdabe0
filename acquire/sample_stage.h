#pragma once

#include <string>

namespace nacre::acquire {

/// What lies in the sample plane while a picture is taken.
enum class Target {
  kNothing,       ///< lens cap on: dark frames
  kCheckerboard,  ///< printed board, in pose `pose`; pose 0 lies flat in the sample
                  ///< plane
  kFlat,          ///< evenly lit white card, for photon transfer
  kReference,     ///< diffuse reflectance standard, flat in the sample plane
  kGlare,         ///< the same, lit by one spot only: all else is scattered light
  kAmbient,       ///< laser off, lens open: pose 0 the reference, pose 1 the sample
  kSample,
};

const char* Name(Target target);

/// Who changes what lies under the camera: a person asked to at a real rig, the
/// simulated rig itself otherwise.
class SampleStage {
 public:
  virtual ~SampleStage() = default;
  /// Returns when the target is in place. Throws Interrupted if the person gives up.
  virtual void Place(Target target, int pose) = 0;
};

}  // namespace nacre::acquire

#pragma once

#include "acquire/rig.h"
#include "acquire/spot_frames.h"
#include "core/toml.h"

namespace nacre::acquire {

/// Reads [illuminator.device] and [safety] into `rig`, all else of which is there
/// already, and checks that what the rig is to light can be lit and may be. Fills in
/// `rig.illuminator` for a laser, `rig.projector` for a projector, neither if there is
/// neither table.
void ReadLight(const TomlTable& root, RigDescription& rig);

/// How the beam visits the spots of the rig's pictures. Throws DeviceError if the
/// exposures leave no time for them. Requires rig.illuminator.
SpotTiming PlanSpots(const RigDescription& rig);

}  // namespace nacre::acquire

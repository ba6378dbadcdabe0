#pragma once

#include "acquire/rig.h"
#include "core/toml.h"
#include "rigs/camera_twin.h"
#include "rigs/laser_twin.h"

namespace nacre::rigs::internal {

struct RigModels {
  CameraModel camera;
  LaserModel laser;
};

/// The [simulated] table but for its phantom, which the caller must have asked for:
/// keys left over are errors. Throws BadData "file:line: key: …".
RigModels ReadModels(const TomlTable& simulated, const acquire::RigDescription& rig);

}  // namespace nacre::rigs::internal

#pragma once

#include "cli/rig_devices.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {

/// A GigE Vision or USB3 Vision camera, a laser behind a Helios DAC or a video
/// projector, and a person who
/// puts the targets in place. See OpenRigDevices.
std::unique_ptr<RigDevices> OpenHardwareRig(const std::filesystem::path& rig_toml,
                                            bool arm_laser);

}  // namespace nacre::cli

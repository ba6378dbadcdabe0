#pragma once

#include "cli/machine_check.h"

#include <string>
#include <vector>

namespace nacre::cli {

/// The GigE Vision and USB3 Vision cameras that answer, and what to do if none does.
/// Takes a second or two.
std::vector<Finding> CheckCameras();

/// Takes a picture with one camera and says what is in it. `camera` is an id or an
/// address, then in Mono8; or a rig description of kind "hardware", then with its
/// settings and its longest exposure. Throws DeviceError if there is no picture.
std::vector<Finding> TryCamera(const std::string& camera);

}  // namespace nacre::cli

#pragma once

#include "cli/machine_check.h"

#include <vector>

namespace nacre::cli {

/// The Helios laser DACs that are plugged in: by which name to open them, and whether
/// they can be. Emits no light.
std::vector<Finding> CheckLasers();

}  // namespace nacre::cli

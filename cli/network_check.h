#pragma once

#include "cli/machine_check.h"

#include <vector>

namespace nacre::cli {

/// Sends frames as a GigE camera would, bursts of 2 MB in packets of 9000 bytes, to
/// this machine itself and receives them with the socket buffer that a camera is given:
/// what is lost here would be lost from a camera too. Takes a third of a second at
/// most.
std::vector<Finding> CheckLoopback();

/// Writes and flushes 64 MB in `folder` for a moment: how fast a session may grow.
std::vector<Finding> CheckDiskSpeed(const std::filesystem::path& folder);

}  // namespace nacre::cli

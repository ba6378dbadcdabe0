#pragma once

#include "render/medium.h"

#include <filesystem>

namespace nacre::render {

/// A grid in Mitsuba 0.6's format: "VOL", version 3, int32 encoding 1 (float32), nodes
/// along x, y, z and channels (1 or 3), box as 6 float32, then values, x fastest; all
/// little endian. Throws BadData for what isn't that, is cut short, isn't finite, or is
/// negative.
VolumeGrid ReadVolumeFile(const std::filesystem::path& path);

}  // namespace nacre::render

#pragma once

#include "core/exr.h"

#include <filesystem>

namespace nacre::reconstruct {

/// Reads a Portable Float Map ("PF": RGB, "Pf": one channel, named Y), either byte
/// order, into picture order. The scale's magnitude multiplies the values unless it is
/// 1. Throws BadData naming what is wrong, before any memory is taken for pixels that
/// the file doesn't hold.
ExrPart ReadPfm(const std::filesystem::path& path);

}  // namespace nacre::reconstruct

#pragma once

#include "core/toml.h"
#include "rigs/phantom.h"

namespace nacre::rigs {

/// How media are arranged under the plane.
struct Structure {
  Pattern pattern;
  std::shared_ptr<const Voxels> voxels = nullptr;
};

/// Reads [pattern] of a phantom that has its slab, media and grid already: a plane
/// pattern, or voxels that are made up from a few numbers or come from files. Throws
/// BadData "file:line: …".
Structure ReadStructure(const TomlTable& table, const Phantom& phantom);

}  // namespace nacre::rigs

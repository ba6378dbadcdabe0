#pragma once

#include "render/mesh.h"

#include <string>
#include <string_view>

namespace nacre::render {

/// Object File Format in text: OFF, counts, positions, faces of any number of corners
/// (split into a fan); what follows on a line (colours) is skipped. Throws BadData with
/// file:line.
TriangleMesh ParseOff(std::string_view text, const std::string& origin);

}  // namespace nacre::render

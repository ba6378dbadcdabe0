#pragma once

#include "render/mesh.h"

#include <filesystem>
#include <string>
#include <string_view>

namespace nacre::render {

/// Wavefront OBJ: v, vt, vn and f, also with negative indices and polygons (split into
/// a fan); everything else is skipped. vt (0, 0) is the lower left corner of a picture.
/// Throws BadData with file:line.
TriangleMesh ReadObj(const std::filesystem::path& path);
TriangleMesh ParseObj(std::string_view text, const std::string& origin);

}  // namespace nacre::render

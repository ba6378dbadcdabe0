#pragma once

#include "render/mesh.h"

#include <filesystem>
#include <string>
#include <string_view>

namespace nacre::render {

/// PLY in all three encodings: vertices with x, y, z and, if there, nx, ny, nz and
/// s, t or u, v (or texture_u, texture_v); faces of any number of corners (split into a
/// fan). Other elements and properties are skipped. Throws BadData naming file and, in
/// text, the line.
TriangleMesh ReadPly(const std::filesystem::path& path);
TriangleMesh ParsePly(std::string_view bytes, const std::string& origin);

}  // namespace nacre::render

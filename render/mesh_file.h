#pragma once

#include "render/mesh.h"

#include <filesystem>
#include <string>

namespace nacre::render {

/// Reads .ply, .obj or .off, each also as .gz. Throws BadData naming the file (and
/// line), and a usage Error for any other name.
TriangleMesh ReadMeshFile(const std::filesystem::path& path);

/// Writes binary PLY atomically: x y z, nx ny nz and s t as far as the mesh has them,
/// triangles, and `provenance` (JSON on one line) as a comment.
void WritePly(const std::filesystem::path& path,
              const TriangleMesh& mesh,
              const std::string& provenance);

}  // namespace nacre::render

#pragma once

#include "render/mesh.h"

#include <filesystem>
#include <string>
#include <string_view>

namespace nacre::render {

/// A mesh of Mitsuba's `.serialized` format (versions 3 and 4, little-endian): header,
/// zlib stream, and at the end of the file a dictionary of where each mesh starts.
/// Positions, normals and uv in single or double precision; colours are skipped.
/// `face_normals` is set if the file says that the mesh is flat. Throws BadData naming
/// `origin` for anything cut short, damaged or out of range; no count is believed
/// before its bytes are there.
struct SerializedMesh {
  TriangleMesh mesh;
  bool face_normals = false;
};
SerializedMesh ReadSerialized(const std::filesystem::path& path, int shape_index);
SerializedMesh ParseSerialized(std::string_view bytes,
                               const std::string& origin,
                               int shape_index);

}  // namespace nacre::render

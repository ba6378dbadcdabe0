#include "render/mesh_file.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "render/gzip.h"
#include "render/obj.h"
#include "render/off.h"
#include "render/ply.h"

#include <bit>
#include <cstring>
#include <fmt/format.h>

namespace nacre::render {
namespace {

static_assert(std::endian::native == std::endian::little,
              "PLY is written as little-endian");

class Bytes {
 public:
  template <class T>
  void Add(const T& value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(&bytes_[at], &value, sizeof(T));
  }
  void Add(const std::string& text) { bytes_ += text; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace

TriangleMesh ReadMeshFile(const std::filesystem::path& path) {
  std::filesystem::path name = path.filename();
  const bool packed = name.extension() == ".gz";
  if (packed) {
    name = name.stem();
  }
  const std::string kind = name.extension().string();
  const auto parse = kind == ".ply"   ? ParsePly
                     : kind == ".obj" ? ParseObj
                     : kind == ".off" ? ParseOff
                                      : nullptr;
  if (parse == nullptr) {
    throw UsageError(
        fmt::format("{}: a mesh is a .ply, .obj or .off, or one of them "
                    "as .gz",
                    path.string()));
  }
  std::string bytes = ReadFile(path);
  if (packed) {
    bytes = Gunzip(bytes, path.string());
  }
  return parse(bytes, path.string());
}

void WritePly(const std::filesystem::path& path,
              const TriangleMesh& mesh,
              const std::string& provenance) {
  Expect(provenance.find('\n') == std::string::npos, "a comment of one line");
  Bytes out;
  out.Add("ply\nformat binary_little_endian 1.0\ncomment nacre " + provenance + "\n" +
          fmt::format("element vertex {}\n", mesh.positions.size()) +
          "property float x\nproperty float y\nproperty float z\n" +
          (mesh.normals.empty()
               ? ""
               : "property float nx\nproperty float ny\nproperty float nz\n") +
          (mesh.uvs.empty() ? "" : "property float s\nproperty float t\n") +
          fmt::format("element face {}\n", mesh.triangles.size()) +
          "property list uchar int vertex_indices\nend_header\n");
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    out.Add(mesh.positions[i]);
    if (!mesh.normals.empty()) {
      out.Add(mesh.normals[i]);
    }
    if (!mesh.uvs.empty()) {
      out.Add(mesh.uvs[i]);
    }
  }
  for (const auto& triangle : mesh.triangles) {
    out.Add(std::uint8_t{3});
    out.Add(triangle);
  }
  WriteFile(path, out.bytes());
}

}  // namespace nacre::render

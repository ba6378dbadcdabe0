#include "render/mesh_file.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "mesh.off";

void Read(const std::filesystem::path& path) {
  render::ReadMeshFile(path);
}

}  // namespace nacre::fuzz

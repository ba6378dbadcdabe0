#include "render/serialized.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "mesh.serialized";

void Read(const std::filesystem::path& path) {
  render::ReadSerialized(path, 0);
}

}  // namespace nacre::fuzz

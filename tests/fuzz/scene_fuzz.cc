#include "render/scene.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "scene.xml";

void Read(const std::filesystem::path& path) {
  render::ReadScene(path);
}

}  // namespace nacre::fuzz

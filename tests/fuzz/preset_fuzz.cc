#include "cli/preset/preset.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "preset.toml";

void Read(const std::filesystem::path& path) {
  preset::ReadPreset(path.parent_path());
}

}  // namespace nacre::fuzz

#include "acquire/rig.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "rig.toml";

void Read(const std::filesystem::path& path) {
  acquire::ReadRig(path);
}

}  // namespace nacre::fuzz

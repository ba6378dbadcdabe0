#include "rigs/phantom.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "phantom.toml";

void Read(const std::filesystem::path& path) {
  rigs::ReadPhantom(path);
}

}  // namespace nacre::fuzz

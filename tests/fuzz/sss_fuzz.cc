#include "factor/sss.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "scan.sss";

void Read(const std::filesystem::path& path) {
  factor::ReadSss(path, {.pitch_mm = 1});
}

}  // namespace nacre::fuzz

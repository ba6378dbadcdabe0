#include "factor/material.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "m.nacre.exr";

void Read(const std::filesystem::path& path) {
  factor::ReadMaterial(path);
}

}  // namespace nacre::fuzz

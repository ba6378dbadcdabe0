#include "reconstruct/import/mat.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "scan.mat";

void Read(const std::filesystem::path& path) {
  reconstruct::ImportMat(path, path.parent_path() / "o.rd.exr", {.pitch_mm = 1}, {});
}

}  // namespace nacre::fuzz

#include "reconstruct/import/npy.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "scan.npy";

void Read(const std::filesystem::path& path) {
  reconstruct::ImportNpy(path, path.parent_path() / "o.rd.exr", {.pitch_mm = 1}, {});
}

}  // namespace nacre::fuzz

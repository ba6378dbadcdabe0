#include "reconstruct/import/psf.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "scan.psf";

void Read(const std::filesystem::path& path) {
  reconstruct::ImportPsf(path, path.parent_path() / "o.rd.exr", {.pitch_mm = 1});
}

}  // namespace nacre::fuzz

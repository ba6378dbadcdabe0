#include "reconstruct/rd_dataset.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "d.rd.exr";

void Read(const std::filesystem::path& path) {
  reconstruct::RdReader reader(path);
  for (int j = 0; j < reader.header().points_y; ++j) {
    for (int i = 0; i < reader.header().points_x; ++i) {
      reader.ReadSlice(i, j);
    }
  }
}

}  // namespace nacre::fuzz

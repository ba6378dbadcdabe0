#include "reconstruct/slice_source.h"

#include <memory>

namespace nacre::reconstruct {

SliceSource DatasetSource(const std::filesystem::path& path) {
  const auto reader = std::make_shared<RdReader>(path);
  return {reader->header(), [reader](int i, int j) { return reader->ReadSlice(i, j); }};
}

}  // namespace nacre::reconstruct

#pragma once

#include "reconstruct/rd_dataset.h"

#include <filesystem>
#include <functional>

namespace nacre::reconstruct {

/// Slices of a sample, from wherever they come: a dataset, a material, memory. Whole
/// samples are asked for in the order of the file, rows from the top.
struct SliceSource {
  RdHeader header;
  std::function<RdSlice(int i, int j)> slice;
};

/// Reads on demand; owns the reader.
SliceSource DatasetSource(const std::filesystem::path& path);

}  // namespace nacre::reconstruct

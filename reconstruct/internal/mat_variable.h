#pragma once

#include "reconstruct/import/array.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace nacre::reconstruct::internal {

/// An array of a MATLAB file, in memory: the first axis runs fastest.
struct MatVariable {
  NumberType type = NumberType::kFloat64;
  std::vector<std::int64_t> extent;
  std::shared_ptr<const unsigned char> data;
};

/// Reads the variable `name` of a MATLAB file of version 5 or 7.3, or with an empty
/// name the only real array of four or five axes. Version 7.3 is read in a child
/// process, since HDF5 can't be kept from crashing on hostile files. Throws BadData for
/// anything that isn't a whole file, and for arrays that unpack to more than
/// `max_bytes`.
MatVariable ReadMatVariable(const std::filesystem::path& path,
                            const std::string& name,
                            std::size_t max_bytes);

/// Bytes of all elements.
std::size_t ByteSize(const MatVariable& variable);

/// Bytes of an element.
std::size_t ByteSize(NumberType type);

}  // namespace nacre::reconstruct::internal

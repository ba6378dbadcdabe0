#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace nacre::reconstruct::internal {

/// A whole file to read from as if it were in memory. Throws Error if it can't be read.
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const unsigned char> bytes() const { return bytes_; }

 private:
  std::span<const unsigned char> bytes_;
};

}  // namespace nacre::reconstruct::internal

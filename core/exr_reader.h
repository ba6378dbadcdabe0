#pragma once

#include "core/exr.h"

#include <memory>

namespace nacre {

/// An OpenEXR file whose parts are read one at a time; otherwise as ReadExr. Not for
/// several threads at once.
class ExrReader {
 public:
  explicit ExrReader(std::filesystem::path path,
                     std::size_t max_bytes = std::size_t{8} << 30);
  ~ExrReader();
  ExrReader(const ExrReader&) = delete;
  ExrReader& operator=(const ExrReader&) = delete;

  /// All parts, without their values.
  const std::vector<ExrPart>& parts() const { return parts_; }
  /// The part of that index with its values.
  ExrPart Read(std::size_t index);

 private:
  struct File;
  std::filesystem::path path_;
  std::unique_ptr<File> file_;
  std::vector<ExrPart> parts_;
};

}  // namespace nacre

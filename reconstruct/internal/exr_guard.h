#pragma once

#include <filesystem>

namespace nacre::reconstruct::internal {

/// Walks the headers of an OpenEXR file and throws BadData naming the attribute if one
/// declares more bytes, or a part more chunks, than the file is long. OpenEXR takes
/// memory for both before it looks: to be called before it opens a file.
void CheckExrSizes(const std::filesystem::path& path);

}  // namespace nacre::reconstruct::internal

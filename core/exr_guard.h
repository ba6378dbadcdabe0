#pragma once

#include <filesystem>

namespace nacre {

/// Walks the headers of an OpenEXR file and throws BadData naming the attribute if one
/// declares more bytes, or a part more chunks, than the file is long, or another size
/// than its type has. OpenEXR takes memory before it looks, and goes by the type where
/// the size says otherwise: to be called before it opens a file.
void CheckExrSizes(const std::filesystem::path& path);

}  // namespace nacre

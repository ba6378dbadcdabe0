#pragma once

#include "acquire/camera.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace nacre::acquire {

/// Of picture `number`, relative to the session folder: frames/000000.pgm.
std::string FrameFileName(std::int64_t number);

/// A frame's counts as a binary 16-bit PGM ("P5", maxval 2^bit_depth − 1): no loss, no
/// compression, read by every picture program.
std::string EncodeFrame(const Frame& frame, int bit_depth);

/// The inverse: width, height and counts. Throws BadData naming `origin` for anything
/// that EncodeFrame wouldn't write.
Frame DecodeFrame(std::string_view bytes, const std::string& origin);

/// Writes in place; the journal, not the name, says that a frame is whole. With
/// `durable`, returns once it is on the disk itself.
void WriteFrameFile(const std::filesystem::path& path,
                    std::string_view bytes,
                    bool durable);

}  // namespace nacre::acquire

#pragma once

#include "acquire/camera.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace nacre::acquire {

/// Of picture `number`, relative to the session folder: frames/000000.pgm.
std::string FrameFileName(std::int64_t number);

/// A frame's counts as a binary PGM ("P5"), of three counts a pixel PPM ("P6"), maxval
/// 2^bit_depth − 1, two bytes a count above 8 bits: no loss, no compression, read by
/// every picture program. A mosaic is written as it is.
std::string EncodeFrame(const Frame& frame, int bit_depth);
/// The same into memory that is there already.
void EncodeFrame(const Frame& frame, int bit_depth, std::string& bytes);

/// The inverse: width, height and counts, three times as many from a PPM. Throws
/// BadData naming `origin` for anything that EncodeFrame wouldn't write.
Frame DecodeFrame(std::string_view bytes, const std::string& origin);

/// Writes in place; the journal, not the name, says that a frame is whole. With
/// `durable`, returns once it is on the disk itself.
void WriteFrameFile(const std::filesystem::path& path,
                    std::string_view bytes,
                    bool durable);

}  // namespace nacre::acquire

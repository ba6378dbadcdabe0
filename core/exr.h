#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace nacre {

/// String attributes of an OpenEXR part; ours are prefixed "nacre.".
using ExrAttributes = std::map<std::string, std::string>;

/// How the values of a part are kept in the file. In memory they are always floats.
enum class ExrPixels {
  kFloat,  ///< FLOAT, ZIP
  kHalf,   ///< HALF, PIZ: values are rounded to 11 significant bits
  kCodes,  ///< UINT, PXR24: whole numbers from 0 to 2^24
};

/// One part of an OpenEXR file held in memory: 32-bit floats, channel after channel
/// (planar), each row by row from the top.
struct ExrPart {
  std::string name;  ///< unique in the file; may be empty in a file of one part
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< "R", "G", "B", "638nm", …
  std::vector<float> values;          ///< channels.size() · height · width
  ExrAttributes attributes;
  ExrPixels pixels = ExrPixels::kFloat;  ///< used by WriteExr alone

  std::size_t PixelCount() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  float* Channel(std::size_t c) { return &values[c * PixelCount()]; }
  const float* Channel(std::size_t c) const { return &values[c * PixelCount()]; }
  /// The index of the channel of that name, or -1.
  int FindChannel(const std::string& channel) const;
};

/// Writes scan lines, losslessly compressed, atomically, in the given order of parts.
void WriteExr(const std::filesystem::path& path, const std::vector<ExrPart>& parts);

/// The size of the file that WriteExr would write.
std::int64_t ExrFileBytes(const std::vector<ExrPart>& parts);

/// Reads all parts of a scan-line or tiled file; HALF and UINT are widened to float;
/// the order of channels is the file's (alphabetical) except that R, G, B come in that
/// order. Throws BadData for anything that isn't a whole OpenEXR file of at most
/// `max_bytes` once unpacked.
std::vector<ExrPart> ReadExr(const std::filesystem::path& path,
                             std::size_t max_bytes = std::size_t{8} << 30);

/// The part of that name, or BadData naming file and part.
const ExrPart& FindPart(const std::vector<ExrPart>& parts,
                        const std::string& name,
                        const std::filesystem::path& path);

}  // namespace nacre

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace nacre::acquire {

/// How a camera lays out a picture in memory: a pixel format of the GenICam Pixel
/// Format Naming Convention.
struct PixelFormat {
  enum class Packing {
    kByte,        ///< one byte a count
    kWord,        ///< two, little endian; the count is at the low end
    kLsbFirst,    ///< 12 bits a count in one stream of bits, low bits first ("p")
    kGigePacked,  ///< 12 bits: high byte, two low nibbles, high byte ("Packed")
  };
  std::string name;
  std::uint32_t code = 0;  ///< in the leader of a frame
  int bit_depth = 0;
  Packing packing = Packing::kWord;
  /// Colours of the pixels: "" monochrome; "RGGB", "GRBG", "GBRG", "BGGR" the upper
  /// left two rows of two of a mosaic; "RGB" each pixel has all three, in this order.
  std::string mosaic;

  int SamplesPerPixel() const { return mosaic == "RGB" ? 3 : 1; }
  /// Of so many counts.
  std::size_t ByteCount(std::size_t counts) const;
};

/// Mono8, 10, 12, 12p, 12Packed, 14, 16; Bayer{RG,GR,GB,BG}8, 10, 12, 12p, 12Packed,
/// 16; RGB8.
const std::vector<PixelFormat>& PixelFormats();

/// Their names, separated by commas, for messages.
std::string PixelFormatNames();

/// Null if there is none of this name.
const PixelFormat* FindPixelFormat(const std::string& name);

/// The counts in `bytes`, which must hold as many as there are in `counts`.
void Unpack(const PixelFormat& format,
            std::span<const std::uint8_t> bytes,
            std::span<std::uint16_t> counts);

}  // namespace nacre::acquire

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace nacre::acquire {

/// How a camera lays out a monochrome picture in memory: a pixel format of the GenICam
/// Pixel Format Naming Convention.
struct MonoFormat {
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

  /// Of a picture of so many pixels.
  std::size_t ByteCount(std::size_t pixels) const;
};

/// Mono8, Mono10, Mono12, Mono12p, Mono12Packed, Mono14, Mono16.
const std::vector<MonoFormat>& MonoFormats();

/// Their names, separated by commas, for messages.
std::string MonoFormatNames();

/// Null if there is none of this name.
const MonoFormat* FindMonoFormat(const std::string& name);

/// The counts in `bytes`, which must hold as many as there are in `counts`.
void Unpack(const MonoFormat& format,
            std::span<const std::uint8_t> bytes,
            std::span<std::uint16_t> counts);

}  // namespace nacre::acquire

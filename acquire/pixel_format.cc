#include "acquire/pixel_format.h"

#include "core/error.h"

#include <bit>
#include <cstring>

namespace nacre::acquire {
namespace {

constexpr std::uint16_t Join(unsigned low, unsigned high, int low_bits) {
  return static_cast<std::uint16_t>(low | high << low_bits);
}

// Two counts in three bytes; the last of an odd number in two.
template <class Pair>
void UnpackPairs(std::span<const std::uint8_t> bytes,
                 std::span<std::uint16_t> counts,
                 Pair pair) {
  const std::size_t whole = counts.size() / 2;
  for (std::size_t k = 0; k < whole; ++k) {
    pair(&bytes[3 * k], &counts[2 * k]);
  }
  if (counts.size() % 2 != 0) {
    const std::uint8_t last[3] = {bytes[3 * whole], bytes[3 * whole + 1], 0};
    std::uint16_t both[2];
    pair(last, both);
    counts.back() = both[0];
  }
}

}  // namespace

std::size_t PixelFormat::ByteCount(std::size_t counts) const {
  switch (packing) {
    case Packing::kByte:
      return counts;
    case Packing::kWord:
      return 2 * counts;
    case Packing::kLsbFirst:
    case Packing::kGigePacked:
      return (3 * counts + 1) / 2;
  }
  throw LogicError("a packing that isn't one");
}

const std::vector<PixelFormat>& PixelFormats() {
  using enum PixelFormat::Packing;
  static const std::vector<PixelFormat> formats{
      {"Mono8", 0x01080001, 8, kByte, ""},
      {"Mono10", 0x01100003, 10, kWord, ""},
      {"Mono12", 0x01100005, 12, kWord, ""},
      {"Mono12p", 0x010C0047, 12, kLsbFirst, ""},
      {"Mono12Packed", 0x010C0006, 12, kGigePacked, ""},
      {"Mono14", 0x01100025, 14, kWord, ""},
      {"Mono16", 0x01100007, 16, kWord, ""},
      {"BayerGR8", 0x01080008, 8, kByte, "GRBG"},
      {"BayerRG8", 0x01080009, 8, kByte, "RGGB"},
      {"BayerGB8", 0x0108000A, 8, kByte, "GBRG"},
      {"BayerBG8", 0x0108000B, 8, kByte, "BGGR"},
      {"BayerGR10", 0x0110000C, 10, kWord, "GRBG"},
      {"BayerRG10", 0x0110000D, 10, kWord, "RGGB"},
      {"BayerGB10", 0x0110000E, 10, kWord, "GBRG"},
      {"BayerBG10", 0x0110000F, 10, kWord, "BGGR"},
      {"BayerGR12", 0x01100010, 12, kWord, "GRBG"},
      {"BayerRG12", 0x01100011, 12, kWord, "RGGB"},
      {"BayerGB12", 0x01100012, 12, kWord, "GBRG"},
      {"BayerBG12", 0x01100013, 12, kWord, "BGGR"},
      {"BayerGR12p", 0x010C0057, 12, kLsbFirst, "GRBG"},
      {"BayerRG12p", 0x010C0059, 12, kLsbFirst, "RGGB"},
      {"BayerGB12p", 0x010C0055, 12, kLsbFirst, "GBRG"},
      {"BayerBG12p", 0x010C0053, 12, kLsbFirst, "BGGR"},
      {"BayerGR12Packed", 0x010C002A, 12, kGigePacked, "GRBG"},
      {"BayerRG12Packed", 0x010C002B, 12, kGigePacked, "RGGB"},
      {"BayerGB12Packed", 0x010C002C, 12, kGigePacked, "GBRG"},
      {"BayerBG12Packed", 0x010C002D, 12, kGigePacked, "BGGR"},
      {"BayerGR16", 0x0110002E, 16, kWord, "GRBG"},
      {"BayerRG16", 0x0110002F, 16, kWord, "RGGB"},
      {"BayerGB16", 0x01100030, 16, kWord, "GBRG"},
      {"BayerBG16", 0x01100031, 16, kWord, "BGGR"},
      {"RGB8", 0x02180014, 8, kByte, "RGB"},
  };
  return formats;
}

std::string PixelFormatNames() {
  std::string names;
  for (const PixelFormat& format : PixelFormats()) {
    names += (names.empty() ? "" : ", ") + format.name;
  }
  return names;
}

const PixelFormat* FindPixelFormat(const std::string& name) {
  for (const PixelFormat& format : PixelFormats()) {
    if (format.name == name) {
      return &format;
    }
  }
  return nullptr;
}

void Unpack(const PixelFormat& format,
            std::span<const std::uint8_t> bytes,
            std::span<std::uint16_t> counts) {
  Expect(bytes.size() >= format.ByteCount(counts.size()), "a whole picture");
  switch (format.packing) {
    case PixelFormat::Packing::kByte:
      for (std::size_t k = 0; k < counts.size(); ++k) {
        counts[k] = bytes[k];
      }
      return;
    case PixelFormat::Packing::kWord:
      if constexpr (std::endian::native == std::endian::little) {
        std::memcpy(counts.data(), bytes.data(), 2 * counts.size());
        return;
      }
      for (std::size_t k = 0; k < counts.size(); ++k) {
        counts[k] = Join(bytes[2 * k], bytes[2 * k + 1], 8);
      }
      return;
    case PixelFormat::Packing::kLsbFirst:
      UnpackPairs(bytes, counts, [](const std::uint8_t* in, std::uint16_t* out) {
        out[0] = Join(in[0], in[1] & 0xFU, 8);
        out[1] = Join(in[1] >> 4U, in[2], 4);
      });
      return;
    case PixelFormat::Packing::kGigePacked:
      UnpackPairs(bytes, counts, [](const std::uint8_t* in, std::uint16_t* out) {
        out[0] = Join(in[1] & 0xFU, in[0], 4);
        out[1] = Join(in[1] >> 4U, in[2], 4);
      });
      return;
  }
}

}  // namespace nacre::acquire

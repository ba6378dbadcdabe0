#include "acquire/mono_format.h"

#include "core/error.h"

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

std::size_t MonoFormat::ByteCount(std::size_t pixels) const {
  switch (packing) {
    case Packing::kByte:
      return pixels;
    case Packing::kWord:
      return 2 * pixels;
    case Packing::kLsbFirst:
    case Packing::kGigePacked:
      return (3 * pixels + 1) / 2;
  }
  throw LogicError("a packing that isn't one");
}

const std::vector<MonoFormat>& MonoFormats() {
  using enum MonoFormat::Packing;
  static const std::vector<MonoFormat> formats{
      {"Mono8", 0x01080001, 8, kByte},
      {"Mono10", 0x01100003, 10, kWord},
      {"Mono12", 0x01100005, 12, kWord},
      {"Mono12p", 0x010C0047, 12, kLsbFirst},
      {"Mono12Packed", 0x010C0006, 12, kGigePacked},
      {"Mono14", 0x01100025, 14, kWord},
      {"Mono16", 0x01100007, 16, kWord},
  };
  return formats;
}

std::string MonoFormatNames() {
  std::string names;
  for (const MonoFormat& format : MonoFormats()) {
    names += (names.empty() ? "" : ", ") + format.name;
  }
  return names;
}

const MonoFormat* FindMonoFormat(const std::string& name) {
  for (const MonoFormat& format : MonoFormats()) {
    if (format.name == name) {
      return &format;
    }
  }
  return nullptr;
}

void Unpack(const MonoFormat& format,
            std::span<const std::uint8_t> bytes,
            std::span<std::uint16_t> counts) {
  Expect(bytes.size() >= format.ByteCount(counts.size()), "a whole picture");
  switch (format.packing) {
    case MonoFormat::Packing::kByte:
      for (std::size_t k = 0; k < counts.size(); ++k) {
        counts[k] = bytes[k];
      }
      return;
    case MonoFormat::Packing::kWord:
      for (std::size_t k = 0; k < counts.size(); ++k) {
        counts[k] = Join(bytes[2 * k], bytes[2 * k + 1], 8);
      }
      return;
    case MonoFormat::Packing::kLsbFirst:
      UnpackPairs(bytes, counts, [](const std::uint8_t* in, std::uint16_t* out) {
        out[0] = Join(in[0], in[1] & 0xFU, 8);
        out[1] = Join(in[1] >> 4U, in[2], 4);
      });
      return;
    case MonoFormat::Packing::kGigePacked:
      UnpackPairs(bytes, counts, [](const std::uint8_t* in, std::uint16_t* out) {
        out[0] = Join(in[1] & 0xFU, in[0], 4);
        out[1] = Join(in[1] >> 4U, in[2], 4);
      });
      return;
  }
}

}  // namespace nacre::acquire

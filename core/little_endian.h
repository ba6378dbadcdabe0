#pragma once

#include <cstdint>

namespace nacre {

inline std::uint32_t LoadLittle32(const unsigned char* bytes) {
  return std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8 |
         std::uint32_t{bytes[2]} << 16 | std::uint32_t{bytes[3]} << 24;
}

inline std::uint64_t LoadLittle64(const unsigned char* bytes) {
  return LoadLittle32(bytes) | std::uint64_t{LoadLittle32(bytes + 4)} << 32;
}

inline void StoreLittle32(std::uint32_t value, unsigned char* bytes) {
  for (int b = 0; b < 4; ++b) {
    bytes[b] = static_cast<unsigned char>(value >> (8 * b));
  }
}

inline void StoreLittle64(std::uint64_t value, unsigned char* bytes) {
  StoreLittle32(static_cast<std::uint32_t>(value), bytes);
  StoreLittle32(static_cast<std::uint32_t>(value >> 32), bytes + 4);
}

}  // namespace nacre

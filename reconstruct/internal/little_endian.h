#pragma once

#include <cstdint>

namespace nacre::reconstruct::internal {

inline std::uint32_t LoadLittle32(const unsigned char* bytes) {
  return std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8 |
         std::uint32_t{bytes[2]} << 16 | std::uint32_t{bytes[3]} << 24;
}

inline void StoreLittle32(std::uint32_t value, unsigned char* bytes) {
  for (int b = 0; b < 4; ++b) {
    bytes[b] = static_cast<unsigned char>(value >> (8 * b));
  }
}

}  // namespace nacre::reconstruct::internal

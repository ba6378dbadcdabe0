#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace nacre {

/// 8- or 16-bit pixels, row by row from the top, channels interleaved.
struct PngImage {
  int width = 0;
  int height = 0;
  int channel_count = 3;  ///< 1 grey, 2 grey+alpha, 3 RGB, 4 RGBA
  int bit_depth = 8;      ///< 8 or 16
  std::vector<std::uint16_t>
      values;  ///< width · height · channel_count, whatever the depth
};

/// Encodes losslessly. `compression` is zlib's, 0 (fastest) to 9.
std::string EncodePng(const PngImage& image, int compression = 3);

/// Encodes and writes atomically.
void WritePng(const std::filesystem::path& path,
              const PngImage& image,
              int compression = 3);

/// Decodes; palette images are expanded. Throws BadData naming `origin`.
PngImage DecodePng(std::span<const char> bytes, const std::string& origin);

PngImage ReadPng(const std::filesystem::path& path);

/// Linear values in [0, 1] (clamped; NaN becomes 0) to 8-bit sRGB [IEC 61966-2-1].
std::uint8_t SrgbFromLinear(float linear);

/// The inverse for one value in [0, 1].
float LinearFromSrgb(float srgb);

}  // namespace nacre

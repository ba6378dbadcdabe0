#pragma once

#include <cstddef>
#include <cstdint>

namespace nacre::reconstruct::internal {

/// The raw "psf" layout of archived scans: little endian int32 W, H, kw, kh
/// (kw = kh = k, odd), then for every pixel (y outer, x inner) k · k · 3 float32 (ky
/// outer, kx inner, RGB innermost), window centre at (k − 1) / 2. y runs upwards, of
/// rows and in windows: the opposite of picture order.
struct PsfLayout {
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::int32_t k = 0;

  static constexpr std::int64_t kHeaderBytes = 16;
  static constexpr int kChannels = 3;

  std::int64_t RecordValues() const { return kChannels * std::int64_t{k} * k; }
  std::int64_t RecordBytes() const { return 4 * RecordValues(); }
  /// Where the record of grid point (i, j), in picture order, begins.
  std::int64_t RecordOffset(int i, int j) const {
    const std::int64_t pixel = std::int64_t{height - 1 - j} * width + i;
    return kHeaderBytes + pixel * RecordBytes();
  }
  /// 16 + 12 · W · H · k², as a double, which can't overflow.
  double FileBytes() const { return kHeaderBytes + 12.0 * width * height * k * k; }
  /// Index in the record of channel c of window cell (u, v), in picture order.
  std::size_t RecordIndex(int c, int u, int v) const {
    return static_cast<std::size_t>((std::int64_t{k - 1 - v} * k + u) * kChannels + c);
  }
};

static_assert(sizeof(float) == 4);

}  // namespace nacre::reconstruct::internal

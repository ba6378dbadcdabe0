#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace nacre::rigs {

/// A user's numbers in space: x fastest, then y upwards, then z downwards.
struct VoxelNumbers {
  std::array<int, 3> count{};  ///< x, y, z
  std::vector<double> value{};
  double full_scale = 1;  ///< what the type of the file calls 1: 255, 65535, or 1
};

enum class RawType { kUint8, kUint16, kFloat32 };

const char* Name(RawType type);

/// A file of numbers and nothing else after `skip_bytes` of header, little-endian, in
/// the order above. Throws BadData unless its size is just right, and for NaN.
struct RawLayout {
  std::array<int, 3> count{};
  RawType type = RawType::kUint8;
  std::uint64_t skip_bytes = 0;
};
VoxelNumbers ReadRawVoxels(const std::filesystem::path& path, const RawLayout& layout);

/// NumPy's .npy, versions 1 to 3, C order, little-endian uint8, uint16 or float32,
/// two or three dimensions: (y, x) or (z, y, x). Row 0 is the lowest y, as in the raw
/// file. Throws BadData naming what it can't read.
VoxelNumbers ReadNpyVoxels(const std::filesystem::path& path);

/// PNG or OpenEXR pictures of equal size as slices, the first one at the surface; the
/// top row is +y. `channel` is that of an EXR file, or empty for its only one; PNG
/// pictures are grey and taken as they are (no gamma).
VoxelNumbers ReadPictures(const std::vector<std::filesystem::path>& paths,
                          const std::string& channel);

}  // namespace nacre::rigs

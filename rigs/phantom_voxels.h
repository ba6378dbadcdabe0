#pragma once

#include "rigs/pattern.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace nacre::rigs {

/// What a voxel is made of: media `first` and `second` of a phantom's list, their
/// coefficients mixed by volume.
struct Blend {
  std::size_t first = 0;
  std::size_t second = 0;
  double second_fraction = 0;
};

/// A box of voxels under the sample plane. x runs fastest, then y (upwards), then z
/// (downwards, from the surface). Points outside belong to the nearest voxel.
struct VoxelLayout {
  std::array<int, 3> count{};
  std::array<double, 3> size_mm{};  ///< of one voxel
  double left_mm = 0;               ///< x of the box's left face
  double lower_mm = 0;              ///< y of its lower face

  std::size_t VoxelCount() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
           static_cast<std::size_t>(count[2]);
  }
  std::size_t Index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(count[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(count[1]) * static_cast<std::size_t>(k));
  }
  /// x, y and depth of a voxel's centre.
  std::array<double, 3> Centre(int i, int j, int k) const {
    return {left_mm + (i + 0.5) * size_mm[0],
            lower_mm + (j + 0.5) * size_mm[1],
            (k + 0.5) * size_mm[2]};
  }
};

/// The most voxels a phantom may have.
inline constexpr std::size_t kMostVoxels = std::size_t{1} << 26;

/// Media in space: each voxel's entry of the palette.
struct Voxels {
  VoxelLayout layout;
  std::vector<std::uint16_t> label;
  std::vector<Blend> palette;
};

/// A number at a point: x, y and depth in mm.
using VoxelFunction = std::function<double(double x_mm, double y_mm, double depth_mm)>;

/// Each medium by itself: label k is medium k.
std::vector<Blend> PurePalette(std::size_t medium_count);

/// A chain of media: 0 is the first one, 1 the last, and in between each passes into
/// the next. kChainLevels labels, so that a mixture is off by at most
/// (medium_count − 1) / (2 (kChainLevels − 1)) of the step between two media.
inline constexpr int kChainLevels = 64;
std::vector<Blend> ChainPalette(std::size_t medium_count);
std::uint16_t ChainLabel(double mixture);

/// Voxels labelled by ChainLabel(mixture) at their centres.
Voxels MixVoxels(const VoxelLayout& layout,
                 std::size_t medium_count,
                 const VoxelFunction& mixture);

/// The same at one depth, as a pattern: not quantised. The layout's voxels must be
/// square in the plane; its depth doesn't matter.
Pattern MixPlane(const VoxelLayout& layout, const VoxelFunction& mixture);

}  // namespace nacre::rigs

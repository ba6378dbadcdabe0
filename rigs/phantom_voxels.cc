#include "rigs/phantom_voxels.h"

#include "core/error.h"
#include "core/parallel.h"
#include "rigs/pattern_mixture.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs {

std::vector<Blend> PurePalette(std::size_t medium_count) {
  std::vector<Blend> palette;
  for (std::size_t k = 0; k < medium_count; ++k) {
    palette.push_back({k, k, 0});
  }
  return palette;
}

std::vector<Blend> ChainPalette(std::size_t medium_count) {
  Expect(medium_count >= 2, "two media to mix");
  std::vector<Blend> palette;
  for (int level = 0; level < kChainLevels; ++level) {
    const double at = static_cast<double>(level) / (kChainLevels - 1) *
                      static_cast<double>(medium_count - 1);
    const auto first = std::min(static_cast<std::size_t>(at), medium_count - 2);
    palette.push_back({first, first + 1, at - static_cast<double>(first)});
  }
  return palette;
}

std::uint16_t ChainLabel(double mixture) {
  return static_cast<std::uint16_t>(
      std::lround(std::clamp(mixture, 0.0, 1.0) * (kChainLevels - 1)));
}

Voxels MixVoxels(const VoxelLayout& layout,
                 std::size_t medium_count,
                 const VoxelFunction& mixture) {
  Expect(layout.VoxelCount() <= kMostVoxels, "no more voxels than may be");
  Voxels voxels{layout, {}, ChainPalette(medium_count)};
  voxels.label.resize(layout.VoxelCount());
  const std::int64_t rows = std::int64_t{layout.count[1]} * layout.count[2];
  ParallelFor(rows, 0, [&](std::int64_t row) {
    const int j = static_cast<int>(row % layout.count[1]);
    const int k = static_cast<int>(row / layout.count[1]);
    for (int i = 0; i < layout.count[0]; ++i) {
      const auto [x, y, depth] = layout.Centre(i, j, k);
      voxels.label[layout.Index(i, j, k)] = ChainLabel(mixture(x, y, depth));
    }
  });
  return voxels;
}

Pattern MixPlane(const VoxelLayout& layout, const VoxelFunction& mixture) {
  Expect(layout.size_mm[0] == layout.size_mm[1], "square cells");
  std::vector<float> fraction(static_cast<std::size_t>(layout.count[0]) *
                              static_cast<std::size_t>(layout.count[1]));
  ParallelFor(layout.count[1], 0, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < layout.count[0]; ++i) {
      const auto [x, y, depth] = layout.Centre(i, j, 0);
      fraction[layout.Index(i, j, 0)] =
          static_cast<float>(std::clamp(mixture(x, y, 0), 0.0, 1.0));
    }
  });
  return {.type = PatternType::kMixture,
          .cell_mm = layout.size_mm[0],
          .mixture = std::make_shared<MixtureMap>(
              MixtureMap::Layout{.count_x = layout.count[0],
                                 .count_y = layout.count[1],
                                 .cell_mm = layout.size_mm[0],
                                 .left_mm = layout.left_mm,
                                 .lower_mm = layout.lower_mm},
              std::move(fraction))};
}

}  // namespace nacre::rigs

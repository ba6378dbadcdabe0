#include "rigs/pattern_mixture.h"

#include "core/error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace nacre::rigs {
namespace {

constexpr int kSamples = 24;

// Bilinear between the centres of a grid's cells; u and v in cells from its corner.
struct Grid {
  const float* cell;
  int count_x;
  int count_y;

  float At(float u, float v) const {
    const float x = std::clamp(u - 0.5F, 0.0F, static_cast<float>(count_x - 1));
    const float y = std::clamp(v - 0.5F, 0.0F, static_cast<float>(count_y - 1));
    const int i = static_cast<int>(x);
    const int j = static_cast<int>(y);
    const float s = x - static_cast<float>(i);
    const float t = y - static_cast<float>(j);
    const int right = i + 1 < count_x ? 1 : 0;
    const int up = j + 1 < count_y ? count_x : 0;
    const float* const at = cell + j * count_x + i;
    const float low = at[0] + s * (at[right] - at[0]);
    const float high = at[up] + s * (at[up + right] - at[up]);
    return low + t * (high - low);
  }
};

}  // namespace

MixtureMap::MixtureMap(const Layout& layout, std::vector<float> fraction)
    : layout_(layout), cells_(std::move(fraction)) {
  Expect(layout.count_x > 0 && layout.count_y > 0 && layout.cell_mm > 0,
         "a mixture with cells of some size");
  Expect(cells_.size() == static_cast<std::size_t>(layout.count_x) *
                              static_cast<std::size_t>(layout.count_y) &&
             cells_.size() <= std::size_t{1} << 28,
         "a fraction for each of at most 2^28 cells");
  Expect(std::all_of(
             cells_.begin(), cells_.end(), [](float f) { return f >= 0 && f <= 1; }),
         "fractions from 0 to 1");
  levels_.push_back({layout.count_x, layout.count_y, 0, 1});
  while (std::min(levels_.back().count_x, levels_.back().count_y) >= 2 * kSamples) {
    const Level fine = levels_.back();
    const Level coarse{(fine.count_x + 1) / 2,
                       (fine.count_y + 1) / 2,
                       static_cast<int>(cells_.size()),
                       0.5F * fine.per_cell};
    for (int j = 0; j < coarse.count_y; ++j) {
      for (int i = 0; i < coarse.count_x; ++i) {
        const auto at = [&](int x, int y) {  // the border goes on
          return cells_[static_cast<std::size_t>(
              fine.begin + std::int64_t{std::min(y, fine.count_y - 1)} * fine.count_x +
              std::min(x, fine.count_x - 1))];
        };
        cells_.push_back(0.25F * (at(2 * i, 2 * j) + at(2 * i + 1, 2 * j) +
                                  at(2 * i, 2 * j + 1) + at(2 * i + 1, 2 * j + 1)));
      }
    }
    levels_.push_back(coarse);
  }
  coarsest_ = static_cast<int>(levels_.size()) - 1;
}

double MixtureMap::At(PointMm point) const {
  const Grid grid{cells_.data(), layout_.count_x, layout_.count_y};
  return static_cast<double>(
      grid.At(static_cast<float>((point.x - layout_.left_mm) / layout_.cell_mm),
              static_cast<float>((point.y - layout_.lower_mm) / layout_.cell_mm)));
}

void MixtureMap::SegmentFractions(PointMm from,
                                  const PointColumns& to,
                                  float* fraction) const {
  const auto left = static_cast<float>(layout_.left_mm);
  const auto lower = static_cast<float>(layout_.lower_mm);
  const auto per_mm = static_cast<float>(1 / layout_.cell_mm);
  const float u0 = (static_cast<float>(from.x) - left) * per_mm;
  const float v0 = (static_cast<float>(from.y) - lower) * per_mm;
  for (std::size_t k = 0; k < to.count; ++k) {
    const float du = (to.x_mm[k] - left) * per_mm - u0;
    const float dv = (to.y_mm[k] - lower) * per_mm - v0;
    // The level whose cells are nearest to the samples' distance, as log₂.
    const float apart2 = (du * du + dv * dv) * (1.0F / (kSamples * kSamples));
    const int octaves = apart2 > 1.0F ? (std::ilogb(apart2) + 1) / 2 : 0;
    const int level_index = std::min(octaves, coarsest_);
    const Level& level = levels_[static_cast<std::size_t>(level_index)];
    const Grid grid{cells_.data() + level.begin, level.count_x, level.count_y};
    const float u = u0 * level.per_cell;
    const float v = v0 * level.per_cell;
    const float step_u = du * level.per_cell / kSamples;
    const float step_v = dv * level.per_cell / kSamples;
    float sum = 0;
    for (int s = 0; s < kSamples; ++s) {
      const float at = static_cast<float>(s) + 0.5F;
      sum += grid.At(u + at * step_u, v + at * step_v);
    }
    fraction[k] = std::clamp(sum / kSamples, 0.0F, 1.0F);
  }
}

}  // namespace nacre::rigs

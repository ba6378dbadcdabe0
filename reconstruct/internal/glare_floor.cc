#include "reconstruct/internal/glare_floor.h"

#include "reconstruct/internal/separation.h"

#include <algorithm>
#include <vector>

namespace nacre::reconstruct::internal {

std::vector<float> Separation::Floor(std::int64_t s) const {
  const auto slot = static_cast<std::size_t>(s);
  std::vector<float> floor(static_cast<std::size_t>(header_.SliceSize()), 0.0F);
  if (!lit_[slot] || !spool_.Holds(group_of_[slot])) {
    return floor;
  }
  const auto all = spool_.Floor(group_of_[slot]);
  const int i = static_cast<int>(s % header_.points_x);
  const int j = static_cast<int>(s / header_.points_x);
  std::size_t at = 0;
  for (int c = 0; c < channels_; ++c) {
    const float enter = EnterFactor(s, c);
    for (int v = 0; v < header_.core; ++v) {
      const std::int64_t cell = c * lattice_.CellCount() + lattice_.Index(i, j + v);
      for (int u = 0; u < header_.core; ++u, ++at) {
        floor[at] = enter * all[static_cast<std::size_t>(cell + u)];
      }
    }
  }
  return floor;
}

std::int64_t MarkBelowFloor(const RdHeader& header,
                            std::span<const float> floor,
                            RdSlice& slice) {
  if (std::all_of(floor.begin(), floor.end(), [](float f) { return f <= 0; })) {
    return 0;
  }
  const int core = header.core;
  const std::vector<std::uint8_t> valid = slice.valid;
  std::int64_t marked = 0;
  for (std::int64_t at = 0; at < header.SliceSize(); ++at) {
    const std::int64_t window = at / header.WindowSize() * header.WindowSize();
    const auto u = static_cast<int>(at % core);
    const auto v = static_cast<int>((at - window) / core);
    float sum = 0;
    float count = 0;
    for (int y = std::max(0, v - 1); y <= std::min(core - 1, v + 1); ++y) {
      for (int x = std::max(0, u - 1); x <= std::min(core - 1, u + 1); ++x) {
        const auto k = static_cast<std::size_t>(window + y * core + x);
        sum += valid[k] != 0 ? slice.rd[k] : 0.0F;
        count += valid[k] != 0 ? 1.0F : 0.0F;
      }
    }
    const auto k = static_cast<std::size_t>(at);
    if (valid[k] != 0 && sum < floor[k] * count) {
      slice.valid[k] = 0;
      ++marked;
    }
  }
  return marked;
}

}  // namespace nacre::reconstruct::internal

#pragma once

#include "render/exitance_source.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace nacre::render {

/// Where on a translucent shape the camera looks, directly or in mirrors, so that light
/// is found closely only where it matters. Stands in for the exitance (of nothing)
/// while a few paths are traced; any number of threads may.
class SeenPlaces final : public ExitanceSource {
 public:
  explicit SeenPlaces(const Shape& shape);

  Color At(const SurfaceHit& hit, const ExitanceQuery& query) const override;

  /// Finds distances; afterwards no place may be added.
  void Finish();

  /// About the least distance, in scene units, to a place seen: at most by a cell's
  /// diagonal too small, never too large for the places that were traced. Infinite if
  /// nothing was seen.
  float DistanceTo(Vec3 position) const;

  std::int64_t seen_count() const { return seen_count_; }  ///< cells

 private:
  static constexpr int kCells = 128;  ///< along the longest side
  std::int64_t CellOf(Vec3 position) const;

  Vec3 low_;
  float per_unit_ = 1;
  std::array<int, 3> size_{1, 1, 1};
  std::unique_ptr<std::atomic<std::uint8_t>[]> seen_;
  std::vector<float> squared_;  ///< distance to the nearest cell seen, in cells
  std::int64_t seen_count_ = 0;
};

}  // namespace nacre::render

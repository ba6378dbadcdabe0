#pragma once

#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace nacre::reconstruct::internal {

/// Slices parked on disk until their turn comes: an anonymous file (already unlinked,
/// so that a crash leaves nothing) with a slot a slice. Holes take no space.
class SliceSpool {
 public:
  /// The file lies in `folder`, made at the first Park().
  SliceSpool(std::filesystem::path folder, const RdHeader& header);
  ~SliceSpool();
  SliceSpool(const SliceSpool&) = delete;
  SliceSpool& operator=(const SliceSpool&) = delete;

  bool Holds(std::int64_t s) const { return holds_[static_cast<std::size_t>(s)]; }
  void Park(std::int64_t s, const RdSlice& slice);
  /// The slice parked as `s`, bit for bit.
  RdSlice Fetch(std::int64_t s) const;

 private:
  std::filesystem::path folder_;
  std::size_t values_;  ///< a slice
  std::vector<bool> holds_;
  int fd_ = -1;
};

}  // namespace nacre::reconstruct::internal

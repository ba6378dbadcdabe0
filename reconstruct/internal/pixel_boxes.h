#pragma once

#include "reconstruct/internal/hdr_merge.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// Weighted sums over boxes of pixels, each row of a box padded to whole vectors: what
/// a linear function of a picture is once its weights are known.
class PixelBoxes {
 public:
  /// Of pictures of that many pixels.
  explicit PixelBoxes(std::int64_t pixel_count) : pixel_count_(pixel_count) {}

  /// One more box, without rows.
  void Begin() { boxes_.emplace_back(); }
  /// One more row of the last box: weights of the pixels from `place` on. All rows of a
  /// box are as long as its first.
  void AddRow(std::int64_t place, std::span<const float> weights);
  /// Another's boxes after the own ones.
  void Append(const PixelBoxes& others);
  void ShrinkToFit();

  std::size_t size() const { return boxes_.size(); }
  bool IsEmpty(std::size_t box) const { return boxes_[box].row_count == 0; }

  float Sum(std::size_t box, const std::vector<float>& picture) const;

  struct Value {
    float mean;
    float variance;  ///< below 0, and mean 0, if a pixel that counts isn't usable
  };
  Value Sum(std::size_t box, const RateFrame& frame) const;

  std::size_t Bytes() const {
    return boxes_.size() * sizeof(Box) + rows_.size() * sizeof(rows_[0]) +
           weights_.size() * sizeof(weights_[0]);
  }

 private:
  struct Box {
    std::size_t first_row = 0;     // in rows_
    std::size_t first_weight = 0;  // in weights_
    int row_count = 0;
    int row_width = 0;
  };

  std::int64_t pixel_count_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> rows_;  // the first pixel of each row of each box
  std::vector<float> weights_;
};

}  // namespace nacre::reconstruct::internal

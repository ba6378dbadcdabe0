#include "reconstruct/internal/pixel_boxes.h"

#include "core/simd_clones.h"
#include "reconstruct/internal/lanes.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace nacre::reconstruct::internal {
namespace {

NACRE_SIMD_CLONES void SumWithVariance(const std::uint32_t* __restrict rows,
                                       const float* __restrict weights,
                                       std::pair<int, int> count_width,
                                       const RateFrame& frame,
                                       float* __restrict results) {
  Lanes mean_sum = {};
  Lanes variance_sum = {};
  Lanes least_share = {};  // below 0: a pixel isn't usable
  const auto [count, width] = count_width;
  for (int row = 0; row < count; ++row) {
    const float* rate_row = frame.rate.data() + rows[row];
    const float* variance_row = frame.variance.data() + rows[row];
    for (int x = 0; x < width; x += kLanes, weights += kLanes) {
      Lanes weight;
      Lanes rate;
      Lanes variance;
      std::memcpy(&weight, weights, sizeof weight);
      std::memcpy(&rate, rate_row + x, sizeof rate);
      std::memcpy(&variance, variance_row + x, sizeof variance);
      const Lanes share = weight * weight * variance;
      mean_sum += weight * rate;
      variance_sum += share;
      least_share = share < least_share ? share : least_share;
    }
  }
  const Lanes nothing = {};
  const bool is_usable = SumOf(least_share < nothing ? nothing + 1 : nothing) == 0;
  results[0] = is_usable ? SumOf(mean_sum) : 0.0F;
  results[1] = is_usable ? SumOf(variance_sum) : -1.0F;
}

NACRE_SIMD_CLONES float SumAlone(const std::uint32_t* __restrict rows,
                                 const float* __restrict weights,
                                 std::pair<int, int> count_width,
                                 const float* __restrict values) {
  Lanes sums = {};
  const auto [count, width] = count_width;
  for (int row = 0; row < count; ++row) {
    for (int x = 0; x < width; x += kLanes, weights += kLanes) {
      Lanes weight;
      Lanes value;
      std::memcpy(&weight, weights, sizeof weight);
      std::memcpy(&value, values + rows[row] + x, sizeof value);
      sums += weight * value;
    }
  }
  return SumOf(sums);
}

}  // namespace

// Rows begin where a whole number of vectors still lies in the picture.
void PixelBoxes::AddRow(std::int64_t place, std::span<const float> weights) {
  Box& own = boxes_.back();
  if (own.row_count == 0) {
    own.first_row = rows_.size();
    own.first_weight = weights_.size();
    own.row_width = (static_cast<int>(weights.size()) + kLanes - 1) / kLanes * kLanes;
  }
  const std::int64_t start =
      std::max<std::int64_t>(0, std::min(place, pixel_count_ - own.row_width));
  rows_.push_back(static_cast<std::uint32_t>(start));
  ++own.row_count;
  const std::size_t at = weights_.size();
  weights_.resize(at + static_cast<std::size_t>(own.row_width), 0.0F);
  std::copy(weights.begin(),
            weights.end(),
            weights_.begin() + static_cast<std::ptrdiff_t>(
                                   at + static_cast<std::size_t>(place - start)));
}

void PixelBoxes::Append(const PixelBoxes& others) {
  for (Box box : others.boxes_) {
    box.first_row += rows_.size();
    box.first_weight += weights_.size();
    boxes_.push_back(box);
  }
  rows_.insert(rows_.end(), others.rows_.begin(), others.rows_.end());
  weights_.insert(weights_.end(), others.weights_.begin(), others.weights_.end());
}

void PixelBoxes::ShrinkToFit() {
  boxes_.shrink_to_fit();
  rows_.shrink_to_fit();
  weights_.shrink_to_fit();
}

float PixelBoxes::Sum(std::size_t box, const std::vector<float>& picture) const {
  const Box& own = boxes_[box];
  return own.row_count == 0 ? 0.0F
                            : SumAlone(&rows_[own.first_row],
                                       &weights_[own.first_weight],
                                       {own.row_count, own.row_width},
                                       picture.data());
}

PixelBoxes::Value PixelBoxes::Sum(std::size_t box, const RateFrame& frame) const {
  const Box& own = boxes_[box];
  float results[2] = {0.0F, -1.0F};
  if (own.row_count > 0) {
    SumWithVariance(&rows_[own.first_row],
                    &weights_[own.first_weight],
                    {own.row_count, own.row_width},
                    frame,
                    results);
  }
  return {results[0], results[1]};
}

}  // namespace nacre::reconstruct::internal

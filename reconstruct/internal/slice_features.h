#pragma once

#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// A slice, or where one lies in a dataset.
struct SliceView {
  std::span<const float> rd;
  std::span<const float> sigma;
  std::span<const std::uint8_t> valid;
};

inline SliceView ViewOf(const RdSlice& slice) {
  return {slice.rd, slice.sigma, slice.valid};
}

/// What a slice looks like, in a few numbers: principal components [Pearson01] of the
/// noise-weighted ln(R'_d / peak + offset) of all channels.
///
/// A cell's weight is the share of its variance between slices that isn't noise
/// (Wiener's), so that cells that hold noise alone don't count, and cells known well
/// count alike. A cell that isn't valid says nothing: it has the mean.
class SliceFeatures {
 public:
  /// Means, weights and components are those of `sample`, at most `dimensions` of them
  /// and fewer than there are slices in it.
  SliceFeatures(const RdHeader& header,
                std::span<const RdSlice> sample,
                double log_offset,
                int dimensions);

  int dimensions() const { return dimensions_; }

  /// The features of `slices`, row by row; on one thread.
  void Project(std::span<const SliceView> slices, std::span<float> features) const;

 private:
  void Shape(const SliceView& slice, std::span<float> shape) const;
  void FindComponents(std::span<const RdSlice> sample, int dimensions);

  std::size_t window_;
  float offset_;
  int dimensions_ = 0;
  std::vector<float> mean_;
  std::vector<float> weight_;
  std::vector<float> components_;  // [cell][dimension], padded to kStride
};

/// The numbers of at most `most` slices of `count`, spread evenly but not in step with
/// any pattern.
std::vector<std::int64_t> SampleSlices(std::int64_t count,
                                       std::int64_t most,
                                       std::uint64_t seed);

}  // namespace nacre::reconstruct::internal

#pragma once

#include "factor/internal/slice_source.h"
#include "factor/material.h"

namespace nacre::factor::internal {

/// Whether a dataset has several channels and each holds the same values, validity and
/// sigma as the first. A few slices tell most of them apart; all are read only if not.
bool HasEqualChannels(SliceSource& source);

/// The first channel of `source`, which must outlive it.
class FirstChannel : public SliceSource {
 public:
  explicit FirstChannel(SliceSource& source);
  const reconstruct::RdHeader& header() const override { return header_; }
  SliceBlock Read(std::int64_t first, std::int64_t count) override;
  bool in_memory() const override { return source_.in_memory(); }

 private:
  SliceSource& source_;
  reconstruct::RdHeader header_;
  std::vector<float> rd_;
  std::vector<std::uint8_t> valid_;
  std::vector<float> sigma_;
};

/// Gives a material of one channel these channels, which share its maps and kernels.
void SpreadChannels(const std::vector<std::string>& channels, Material& material);

}  // namespace nacre::factor::internal

#pragma once

#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace nacre::factor::internal {

/// Consecutive slices, laid out as in reconstruct::RdDataset.
struct SliceBlock {
  std::int64_t first = 0;
  std::int64_t count = 0;
  const float* rd = nullptr;
  const std::uint8_t* valid = nullptr;
  const float* sigma = nullptr;          ///< 0 where unknown; null: unknown
  const std::int64_t* weight = nullptr;  ///< slices that each stands for; null: one
};

/// A dataset read front to back as often as needed, a block at a time.
class SliceSource {
 public:
  virtual ~SliceSource() = default;
  virtual const reconstruct::RdHeader& header() const = 0;
  /// The block stays valid until the next call.
  virtual SliceBlock Read(std::int64_t first, std::int64_t count) = 0;
  /// Slices `rows` (ascending) are in `dataset`, one after the other, and needn't be
  /// read again; null: none are. Both must live until the next call.
  virtual void Know(const std::vector<std::int64_t>* /*rows*/,
                    const reconstruct::RdDataset* /*dataset*/) {}
  /// Whether reading costs next to nothing.
  virtual bool in_memory() const { return false; }
};

/// Slices of a dataset in memory. Throws BadData naming the value if a size is wrong.
std::unique_ptr<SliceSource> SourceOf(const reconstruct::RdDataset& dataset);

/// Slices of a file: every pass reads the file again, on a thread of its own one block
/// ahead of what was asked for last, so that two are in memory. Between a block and the
/// last one of the file nobody else may use `reader`.
std::unique_ptr<SliceSource> SourceOf(reconstruct::RdReader& reader);

}  // namespace nacre::factor::internal

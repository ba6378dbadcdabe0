#pragma once

#include "core/progress.h"
#include "factor/internal/method.h"
#include "factor/internal/slice_source.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace nacre::factor::internal {

/// Slices sorted into sets of equal ones: the same bits of R_d and validity in all
/// channels (by a hash of 128 bits). Sigma isn't looked at.
struct EqualRows {
  std::vector<std::int64_t> first;  ///< slice of each set, ascending
  std::vector<std::int64_t> count;  ///< slices of each set
  std::vector<std::int64_t> set;    ///< [point]
};

/// No more sets than these: beyond, block iteration is quicker with all slices.
inline constexpr std::int64_t kMostDistinctRows = 8191;

/// Reads all slices once, but only if two of some 128 are equal. Nothing where more
/// than half are distinct, or more than kMostDistinctRows, or a value isn't finite.
std::optional<EqualRows> FindEqualRows(SliceSource& source,
                                       const ProgressFunction& progress);

/// One slice of each set, with how many there are as its weight: a dataset of one row
/// of points. `source` must outlive it.
class DistinctRows final : public SliceSource {
 public:
  DistinctRows(SliceSource& source, EqualRows rows);
  const reconstruct::RdHeader& header() const override { return header_; }
  SliceBlock Read(std::int64_t first, std::int64_t count) override;
  bool in_memory() const override { return source_.in_memory(); }
  const EqualRows& rows() const { return rows_; }

 private:
  SliceSource& source_;
  EqualRows rows_;
  reconstruct::RdHeader header_;
  std::vector<float> rd_;
  std::vector<std::uint8_t> valid_;
};

/// Gives all points of planes over the grid what the first point of their set has.
template <class T>
void CopyFromFirst(const EqualRows& rows, std::vector<T>& planes) {
  const std::size_t points = rows.set.size();
  for (std::size_t plane = 0; plane < planes.size(); plane += points) {
    for (std::size_t point = 0; point < points; ++point) {
      const auto set = static_cast<std::size_t>(rows.set[point]);
      planes[plane + point] = planes[plane + static_cast<std::size_t>(rows.first[set])];
    }
  }
}

/// An SVD of job.distinct, whose materials have all points. The job must outlive it.
std::unique_ptr<Method> MakeDistinctSvdMethod(Job& job);

}  // namespace nacre::factor::internal

#pragma once

#include "core/rank_shares.h"

#include <cstdint>
#include <span>

namespace nacre::factor::internal {

/// Rows in their order, cut into lots of whole blocks, which depend on the number of
/// rows alone. Ranks share the lots (ShareOf); sums are made lot by lot and added by
/// core/lot_sum.h, so that their bits are those of one process.
class RowLots {
 public:
  /// At most `most` lots of whole blocks of `block_rows`, but for the last block.
  RowLots(std::int64_t rows, std::int64_t block_rows, std::int64_t most = 64);

  std::int64_t count() const { return count_; }
  /// The first row of a lot, or the end of the last for `count()`.
  std::int64_t Begin(std::int64_t lot) const;
  /// The rows of a rank's lots.
  RankShare RowsOf(int rank, int size) const;
  RankShare RowsOf(const Ranks* ranks) const;

  /// Collective: values of rows of which each rank has those of its lots, in all of
  /// them.
  template <class T>
  void Join(const Ranks* ranks, std::span<T> values) const {
    JoinSharesBy(
        rows_, ranks, values, [&](int rank, int size) { return RowsOf(rank, size); });
  }

 private:
  std::int64_t rows_;
  std::int64_t block_rows_;
  std::int64_t blocks_;
  std::int64_t count_;
};

}  // namespace nacre::factor::internal

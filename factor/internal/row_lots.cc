#include "factor/internal/row_lots.h"

#include <algorithm>

namespace nacre::factor::internal {

RowLots::RowLots(std::int64_t rows, std::int64_t block_rows, std::int64_t most)
    : rows_(rows),
      block_rows_(block_rows),
      blocks_((rows + block_rows - 1) / block_rows),
      count_(std::min(most, blocks_)) {}

std::int64_t RowLots::Begin(std::int64_t lot) const {
  return count_ == 0 ? 0 : std::min(rows_, lot * blocks_ / count_ * block_rows_);
}

RankShare RowLots::RowsOf(int rank, int size) const {
  const RankShare lots = ShareOf(count_, rank, size);
  return {Begin(lots.begin), Begin(lots.end)};
}

RankShare RowLots::RowsOf(const Ranks* ranks) const {
  return ranks == nullptr ? RankShare{0, rows_} : RowsOf(ranks->rank(), ranks->size());
}

}  // namespace nacre::factor::internal

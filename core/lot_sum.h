#pragma once

#include "core/ranks.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre {

/// The sum of vectors that many parts of a work ("lots") make, over all ranks. Adds
/// along a binary tree over the lots, so that its bits depend on their number alone. A
/// rank computes the lots of ShareOf(lot_count, ranks) and holds log2 of their number
/// vectors at most.
class LotSum {
 public:
  explicit LotSum(std::int64_t lot_count, const Ranks* ranks = nullptr);

  /// The next of this rank's lots: they come in order, and all.
  void Add(std::vector<double> values);

  /// Collective: the total, on all ranks; nothing if there are no lots.
  std::vector<double> Finish();

 private:
  struct Node {  // lots [index, index + 1) << level
    int level = 0;
    std::int64_t index = 0;
    std::vector<double> values;
  };
  int Owner(std::int64_t lot) const;
  std::vector<double> Reduce(int level, std::int64_t index);

  std::int64_t lot_count_;
  const Ranks* ranks_;
  RankShare own_;
  std::int64_t next_;
  std::vector<Node> nodes_;
};

}  // namespace nacre

#pragma once

#include "core/progress.h"
#include "core/ranks.h"
#include "factor/internal/slice_source.h"
#include "factor/internal/truncated_svd.h"

#include <algorithm>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace nacre::factor::internal {

/// Writes a row of a channel's matrix, padded (row_kernels.h), and returns Σ y².
using FillRowFunction = std::function<float(
    const SliceBlock& block, std::int64_t row, std::size_t channel, float* y)>;

/// What one pass over the rows of Y makes of a basis V of k columns: U = Y V and
/// Z = Yᵀ U, from one reading of Y.
struct BlockProduct {
  Eigen::MatrixXd z;     ///< columns × k
  Eigen::MatrixXd gram;  ///< UᵀU
  Eigen::VectorXd sum;   ///< of U's columns
  double squares = 0;    ///< Σ y²
  std::vector<float> u;  ///< [panel][row][kPanel]; of other ranks' rows 0
};

/// Who does a pass, which doesn't change a bit of its sums.
struct PassWorkers {
  int thread_count = 0;
  const Ranks* ranks = nullptr;  ///< collective calls, unless null
};

/// The rows of that many that this rank reads in a pass.
RankShare PassShare(std::int64_t points, int rank, int size);
RankShare PassShare(std::int64_t points, const Ranks* ranks);

/// Collective: planes of `width` values a row, of which each rank has those of its
/// share, are whole in all of them.
template <class T>
void JoinPassRows(std::int64_t points,
                  std::size_t width,
                  const Ranks* ranks,
                  std::span<T> plane) {
  if (ranks == nullptr || ranks->size() == 1) {
    return;
  }
  const auto part = [&](const RankShare& share) {
    return plane.subspan(static_cast<std::size_t>(share.begin) * width,
                         static_cast<std::size_t>(share.end - share.begin) * width);
  };
  const auto all =
      ranks->AllGather(ToBytes(std::span<const T>(part(PassShare(points, ranks)))));
  for (std::size_t rank = 0; rank < all.size(); ++rank) {
    const std::span<T> to =
        part(PassShare(points, static_cast<int>(rank), ranks->size()));
    const auto values = FromBytes<T>(all[rank]);
    std::copy(values.begin(), values.end(), to.begin());
  }
}

/// One pass for the matrices of `channels`, with a basis each (all of a whole number of
/// panels). Y is a channel's rows as `fill` makes them. Products are in floats, their
/// sums over blocks of rows in double. Rows always go to the same sums in the same
/// order, so the bits don't depend on the number of threads and ranks.
std::vector<BlockProduct> RunBlockPass(SliceSource& source,
                                       const FillRowFunction& fill,
                                       const std::vector<std::size_t>& channels,
                                       const std::vector<Eigen::MatrixXd>& bases,
                                       const PassWorkers& workers,
                                       const ProgressFunction& progress,
                                       const std::string& note);

}  // namespace nacre::factor::internal

#pragma once

#include "factor/internal/block_pass.h"

#include <cstdint>
#include <vector>

namespace nacre::factor::internal {

/// Rows on which the basis is found before it sees all.
inline constexpr int kSvdSampleRows = 4096;

/// What BlockSvdSolver is asked for.
struct BlockSvdOptions {
  int terms = 10;
  /// Bound on the excess of ‖Y − Ŷ‖ over that of the truncated SVD, as a fraction,
  /// estimated after each pass; above it there is another.
  double tolerance = 1e-5;
  int least_passes = 1;
  int most_passes = 12;
  int spare = 4;  ///< columns beyond the terms, at least: more save passes
  Workers workers = {};
};

/// One matrix' truncated SVD.
struct BlockSvd {
  Eigen::VectorXd sigma;      ///< largest first
  Eigen::MatrixXd vectors;    ///< columns × rank, orthonormal, signs canonical
  std::vector<float> scores;  ///< [row][rank]: U Σ, of other ranks' rows 0
  Eigen::VectorXd mean;       ///< of the scores over the rows
  double squares = 0;         ///< Σ y²
  double excess = 0;          ///< estimated, see BlockSvdOptions::tolerance
};

/// Passes and matrices of a set that went through them together.
struct BlockSvds {
  std::vector<BlockSvd> svds;
  int passes = 0;  ///< over all rows
};

/// Truncated SVDs of tall matrices, one a channel, by block subspace iteration
/// [Halko11, alg. 4.4]: the basis is found on a sample of rows, where passes cost
/// little, and one pass over all rows then gives U = Y V and Z = Yᵀ U. Of Y's
/// projection on the range of U, Q Qᵀ Y with Qᵀ Y made of Z, the SVD is taken: that is
/// half an iteration better than V and needs no further reading of Y.
///
/// `sample` and `source` have the same header but for the number of points. After each
/// pass `basis_changed`, if given, is told channel and result, for rows that are
/// completed by it.
class BlockSvdSolver {
 public:
  using BasisChanged = std::function<void(std::size_t channel, const BlockSvd&)>;

  BlockSvdSolver(FillRowFunction fill,
                 std::vector<std::size_t> channels,
                 const BlockSvdOptions& options)
      : fill_(std::move(fill)), channels_(std::move(channels)), options_(options) {}

  void OnBasis(BasisChanged changed) { changed_ = std::move(changed); }
  BlockSvds Solve(SliceSource& sample,
                  SliceSource& source,
                  const ProgressFunction& progress);

 private:
  void Start(const reconstruct::RdHeader& header);
  void SolveSample(SliceSource& sample, const ProgressFunction& progress);

  FillRowFunction fill_;
  std::vector<std::size_t> channels_;
  BlockSvdOptions options_;
  BasisChanged changed_;
  std::vector<Eigen::MatrixXd> bases_;
};

}  // namespace nacre::factor::internal

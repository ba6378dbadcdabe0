#pragma once

#include "factor/internal/truncated_svd.h"

#include <cstdint>
#include <span>

namespace nacre::factor::internal {

/// YᵀY and the column sums of the rows seen so far.
struct GramSum {
  explicit GramSum(Eigen::Index columns)
      : gram(Eigen::MatrixXd::Zero(columns, columns)),
        column_sum(Eigen::VectorXd::Zero(columns)) {}

  Eigen::MatrixXd gram;  ///< the lower triangle
  Eigen::VectorXd column_sum;
  std::int64_t rows = 0;

  /// Adds the rows of `y`, each as often as `weight` says (whole numbers), to columns
  /// [first, first + count) of the lower triangle.
  /// Panels may be added at the same time; each sums blocks in the order it is given
  /// them, so the bits don't depend on the number of threads.
  void AddPanel(const RowMatrix& y,
                const Eigen::VectorXd& weight,
                Eigen::Index first,
                Eigen::Index count);
};

/// The leading right singular vectors of the rows of a channel (and cluster), with what
/// is known of the rows' coordinates in them, for rows measured in part.
struct RowBasis {
  Eigen::MatrixXd vectors;  ///< cells × rank, orthonormal, signs canonical
  Eigen::VectorXd sigma;    ///< singular values
  Eigen::VectorXd mean;     ///< of the coordinates over the rows
  Eigen::VectorXd variance;
  double residual_variance = 0;  ///< of a cell, outside the basis
  std::int64_t rows = 0;

  Eigen::Index rank() const { return sigma.size(); }

  /// The coordinates of a whole row: its products with the vectors.
  Eigen::VectorXd Coordinates(std::span<const double> row) const;

  /// The most probable coordinates given the valid cells alone, the coordinates and the
  /// residual being taken as normally distributed: least squares where much is
  /// measured, the mean row where nothing is. The expectation step of probabilistic
  /// principal components [Tipping99, sec. 3.3].
  Eigen::VectorXd PartialCoordinates(std::span<const double> row,
                                     std::span<const std::uint8_t> valid) const;
};

/// `one_by_one`: each vector from the residual of those before.
RowBasis BasisOf(const GramSum& sum, int terms, bool one_by_one = false);

}  // namespace nacre::factor::internal

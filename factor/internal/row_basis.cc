#include "factor/internal/row_basis.h"

#include <Eigen/Cholesky>

#include <algorithm>

namespace nacre::factor::internal {

void GramSum::AddPanel(const RowMatrix& y,
                       const Eigen::VectorXd& weight,
                       Eigen::Index first,
                       Eigen::Index count) {
  const Eigen::Index below = y.cols() - first;
  const RowMatrix panel = weight.asDiagonal() * y.middleCols(first, count);
  gram.block(first, first, below, count).noalias() +=
      y.rightCols(below).transpose() * panel;
  column_sum.segment(first, count) += panel.colwise().sum();
  if (first == 0) {
    rows += static_cast<std::int64_t>(weight.sum());
  }
}

RowBasis BasisOf(const GramSum& sum, int terms, bool one_by_one) {
  RowBasis basis;
  basis.rows = sum.rows;
  LeadingEigen eigen =
      one_by_one ? DeflateEigen(sum.gram, terms) : ComputeLeadingEigen(sum.gram, terms);
  basis.vectors = std::move(eigen.vectors);
  MakeSignsCanonical(basis.vectors);
  basis.sigma = eigen.values.cwiseSqrt();
  const auto n = static_cast<double>(std::max(sum.rows, std::int64_t{1}));
  basis.mean = basis.vectors.transpose() * sum.column_sum / n;
  basis.variance = (eigen.values / n - basis.mean.cwiseAbs2()).cwiseMax(0);
  const double left = sum.gram.trace() - eigen.values.sum();
  basis.residual_variance =
      std::max(0.0, left) / (n * static_cast<double>(sum.gram.rows()));
  return basis;
}

Eigen::VectorXd RowBasis::Coordinates(std::span<const double> row) const {
  const Eigen::Map<const Eigen::VectorXd> values(row.data(),
                                                 static_cast<Eigen::Index>(row.size()));
  return vectors.transpose() * values;
}

Eigen::VectorXd RowBasis::PartialCoordinates(
    std::span<const double> row, std::span<const std::uint8_t> valid) const {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(rank(), rank());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(rank());
  for (std::size_t cell = 0; cell < row.size(); ++cell) {
    if (valid[cell] != 0) {
      const Eigen::VectorXd v = vectors.row(static_cast<Eigen::Index>(cell));
      normal.selfadjointView<Eigen::Lower>().rankUpdate(v);
      right += v * (row[cell] - v.dot(mean));
    }
  }
  // An exact fit (no residual) still needs a little of the prior, or cells that were
  // never measured together would leave the equations singular.
  const double scale = rank() > 0 ? std::max(sigma(0) * sigma(0), 1e-300) : 1;
  const double per_row = scale / static_cast<double>(std::max(rows, std::int64_t{1}));
  const double residual = std::max(residual_variance, 1e-14 * per_row);
  for (Eigen::Index j = 0; j < rank(); ++j) {
    normal(j, j) += residual / std::max(variance(j), 1e-12 * per_row);
  }
  return mean + normal.selfadjointView<Eigen::Lower>().ldlt().solve(right);
}

}  // namespace nacre::factor::internal

#include "factor/internal/truncated_svd.h"

#include <Eigen/Eigenvalues>

#include <Spectra/MatOp/DenseSymMatProd.h>
#include <Spectra/SymEigsSolver.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre::factor::internal {
namespace {

LeadingEigen SolveDense(const Eigen::MatrixXd& gram, int count) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  return {solver.eigenvalues().tail(count).reverse(),
          solver.eigenvectors().rightCols(count).rowwise().reverse()};
}

// Spectra takes a pair for converged at a residual of tolerance · max(ε^(2/3),
// |value|). With the matrix scaled to ε^(2/3) that is an absolute bound, which the
// zeros of a rank-deficient matrix meet too.
const double kSpectraFloor = std::pow(std::numeric_limits<double>::epsilon(), 2.0 / 3);

// Lanczos pays when few pairs of many are wanted. Should it not converge, the dense
// solver gives the same answer more slowly.
LeadingEigen Solve(const Eigen::MatrixXd& gram, int count, double tolerance) {
  const auto n = static_cast<int>(gram.rows());
  const int krylov = std::max(2 * count + 10, 24);
  if (krylov >= n / 2) {
    return SolveDense(gram, count);
  }
  Spectra::DenseSymMatProd<double> product(gram);
  Spectra::SymEigsSolver<Spectra::DenseSymMatProd<double>> solver(
      product, count, krylov);
  solver.init();
  solver.compute(Spectra::SortRule::LargestAlge, 300, tolerance);
  if (solver.info() != Spectra::CompInfo::Successful ||
      !solver.eigenvectors().allFinite()) {
    return SolveDense(gram, count);
  }
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace

LeadingEigen ComputeLeadingEigen(const Eigen::MatrixXd& gram,
                                 int count,
                                 double tolerance) {
  const auto n = static_cast<int>(gram.rows());
  LeadingEigen result{Eigen::VectorXd(0), Eigen::MatrixXd(n, 0)};
  const double scale = n > 0 ? gram.diagonal().maxCoeff() : 0;
  if (!(scale > 0)) {
    return result;
  }
  const double factor = kSpectraFloor / scale;
  result = Solve(gram * factor, std::min(count, n), tolerance);
  const double least = kRankTolerance * kRankTolerance * result.values(0);
  int rank = 0;
  while (rank < result.values.size() && result.values(rank) > least) {
    ++rank;
  }
  result.values = (result.values.head(rank) / factor).eval();
  result.vectors = result.vectors.leftCols(rank).eval();
  return result;
}

TruncatedSvd ComputeTruncatedSvd(const RowMatrix& y, int terms, double tolerance) {
  const Eigen::Index side = std::min(y.rows(), y.cols());
  const bool wide = y.rows() < y.cols();
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(side, side);
  if (wide) {
    gram.selfadjointView<Eigen::Lower>().rankUpdate(y);
  } else {
    gram.selfadjointView<Eigen::Lower>().rankUpdate(y.transpose());
  }
  const LeadingEigen eigen = ComputeLeadingEigen(gram, terms, tolerance);
  TruncatedSvd svd;
  svd.sigma = eigen.values.cwiseSqrt();
  if (wide) {
    svd.basis = y.transpose() * eigen.vectors;
    for (Eigen::Index j = 0; j < svd.basis.cols(); ++j) {
      svd.basis.col(j) /= svd.sigma(j);
    }
  } else {
    svd.basis = eigen.vectors;
  }
  MakeSignsCanonical(svd.basis);
  svd.scores = y * svd.basis;
  return svd;
}

void MakeSignsCanonical(Eigen::MatrixXd& vectors) {
  for (Eigen::Index j = 0; j < vectors.cols(); ++j) {
    Eigen::Index largest = 0;
    vectors.col(j).cwiseAbs().maxCoeff(&largest);
    if (vectors(largest, j) < 0) {
      vectors.col(j) = -vectors.col(j);
    }
  }
}

}  // namespace nacre::factor::internal

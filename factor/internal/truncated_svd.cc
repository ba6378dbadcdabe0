#include "factor/internal/truncated_svd.h"

#include <Eigen/Eigenvalues>

#include <Spectra/MatOp/DenseSymMatProd.h>
#include <Spectra/SymEigsSolver.h>
#include <algorithm>

namespace nacre::factor::internal {
namespace {

LeadingEigen SolveDense(const Eigen::MatrixXd& gram, int count) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  return {solver.eigenvalues().tail(count).reverse(),
          solver.eigenvectors().rightCols(count).rowwise().reverse()};
}

// Lanczos pays when few pairs of many are wanted. Should it not converge, the dense
// solver gives the same answer more slowly.
LeadingEigen Solve(const Eigen::MatrixXd& gram, int count, double tolerance) {
  const auto n = static_cast<int>(gram.rows());
  const int krylov = std::max(2 * count + 10, 24);
  if (krylov >= n / 2) {
    return SolveDense(gram, count);
  }
  // Spectra bounds residuals relative to each eigenvalue, which the zeros of a
  // rank-deficient matrix never meet. With the trace, which no eigenvalue exceeds,
  // added to all of them, the bound is relative to the trace; the vectors stay the
  // same.
  const Eigen::MatrixXd shifted =
      gram / gram.trace() + Eigen::MatrixXd::Identity(gram.rows(), gram.cols());
  Spectra::DenseSymMatProd<double> product(shifted);
  Spectra::SymEigsSolver<Spectra::DenseSymMatProd<double>> solver(
      product, count, krylov);
  solver.init();
  solver.compute(Spectra::SortRule::LargestAlge, 300, tolerance);
  if (solver.info() != Spectra::CompInfo::Successful) {
    return SolveDense(gram, count);
  }
  const Eigen::MatrixXd vectors = solver.eigenvectors();
  const Eigen::MatrixXd images = gram.selfadjointView<Eigen::Lower>() * vectors;
  return {vectors.cwiseProduct(images).colwise().sum().transpose(), vectors};
}

}  // namespace

LeadingEigen ComputeLeadingEigen(const Eigen::MatrixXd& gram,
                                 int count,
                                 double tolerance) {
  const auto n = static_cast<int>(gram.rows());
  LeadingEigen result{Eigen::VectorXd(0), Eigen::MatrixXd(n, 0)};
  if (!(gram.trace() > 0)) {
    return result;
  }
  result = Solve(gram, std::min(count, n), tolerance);
  const double least = kRankTolerance * kRankTolerance * result.values(0);
  int rank = 0;
  while (rank < result.values.size() && result.values(rank) > least) {
    ++rank;
  }
  result.values = result.values.head(rank).eval();
  result.vectors = result.vectors.leftCols(rank).eval();
  return result;
}

LeadingEigen DeflateEigen(const Eigen::MatrixXd& gram, int count) {
  LeadingEigen result{Eigen::VectorXd(0), Eigen::MatrixXd(gram.rows(), 0)};
  Eigen::MatrixXd left = gram.selfadjointView<Eigen::Lower>();
  while (result.values.size() < count) {
    const LeadingEigen next = ComputeLeadingEigen(left, 1);
    const Eigen::Index n = result.values.size();
    if (next.values.size() == 0 ||
        (n > 0 &&
         next.values(0) <= kRankTolerance * kRankTolerance * result.values(0))) {
      break;
    }
    const Eigen::VectorXd v = next.vectors.col(0);
    result.values.conservativeResize(n + 1);
    result.values(n) = next.values(0);
    result.vectors.conservativeResize(Eigen::NoChange, n + 1);
    result.vectors.col(n) = v;
    // The residual Y (1 − v vᵀ), by its Gram matrix.
    left -= v * (v.transpose() * left);
    left -= (left * v) * v.transpose();
  }
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

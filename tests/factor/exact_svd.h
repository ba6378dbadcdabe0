#pragma once

#include <Eigen/Core>

namespace nacre::testing {

/// Y = U diag(σ) Vᵀ by Eigen's one-sided Jacobi rotations: slow, and right to the last
/// digits. Compiled once, since its templates cost as much as a whole file of tests.
struct ExactSvd {
  Eigen::MatrixXd u;      ///< rows × n, n the smaller side
  Eigen::VectorXd sigma;  ///< n, falling
  Eigen::MatrixXd v;      ///< columns × n

  /// The nearest matrix of that rank [Eckart36].
  Eigen::MatrixXd OfRank(int terms) const;
};

ExactSvd ComputeExactSvd(const Eigen::MatrixXd& y);

}  // namespace nacre::testing

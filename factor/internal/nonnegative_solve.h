#pragma once

#include <Eigen/Core>

namespace nacre::factor::internal {

/// The x ≥ 0 that minimises xᵀGx − 2cᵀx, G being symmetric and positive semidefinite:
/// least squares with no negative unknown, by active sets [Lawson74, ch. 23]. Both
/// triangles of `gram` are read. For a few unknowns.
Eigen::VectorXd SolveNonnegative(const Eigen::MatrixXd& gram,
                                 const Eigen::VectorXd& cross);

}  // namespace nacre::factor::internal

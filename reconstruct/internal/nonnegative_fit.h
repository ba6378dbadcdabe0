#pragma once

#include <Eigen/Core>

namespace nacre::reconstruct::internal {

/// The x ≥ 0 that makes |A x − b| least, by active sets [Lawson74, algorithm NNLS].
Eigen::VectorXd FitNonnegative(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

}  // namespace nacre::reconstruct::internal

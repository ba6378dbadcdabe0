#include "tests/factor/exact_svd.h"

#include <Eigen/SVD>

namespace nacre::testing {

Eigen::MatrixXd ExactSvd::OfRank(int terms) const {
  return u.leftCols(terms) * sigma.head(terms).asDiagonal() *
         v.leftCols(terms).transpose();
}

ExactSvd ComputeExactSvd(const Eigen::MatrixXd& y) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(
      y, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

}  // namespace nacre::testing

#include "reconstruct/internal/nonnegative_fit.h"

#include <Eigen/QR>

#include <algorithm>
#include <vector>

namespace nacre::reconstruct::internal {
namespace {

// Least squares over the columns that are free; 0 for the others.
Eigen::VectorXd SolveFree(const Eigen::MatrixXd& a,
                          const Eigen::VectorXd& b,
                          const std::vector<bool>& is_free) {
  std::vector<Eigen::Index> columns;
  for (std::size_t k = 0; k < is_free.size(); ++k) {
    if (is_free[k]) {
      columns.push_back(static_cast<Eigen::Index>(k));
    }
  }
  Eigen::VectorXd x = Eigen::VectorXd::Zero(a.cols());
  x(columns) = Eigen::MatrixXd(a(Eigen::all, columns)).colPivHouseholderQr().solve(b);
  return x;
}

}  // namespace

Eigen::VectorXd FitNonnegative(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  const auto count = static_cast<std::size_t>(a.cols());
  std::vector<bool> is_free(count, false);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(a.cols());
  const double tolerance = 1e-12 * (a.transpose() * b).cwiseAbs().maxCoeff();
  for (std::size_t round = 0; round < 3 * count; ++round) {
    // The column held at 0 that would do the most good.
    const Eigen::VectorXd gradient = a.transpose() * (b - a * x);
    std::size_t best = count;
    for (std::size_t k = 0; k < count; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      if (!is_free[k] && gradient(at) > tolerance &&
          (best == count || gradient(at) > gradient(static_cast<Eigen::Index>(best)))) {
        best = k;
      }
    }
    if (best == count) {
      break;
    }
    is_free[best] = true;
    // As far towards the solution as nothing becomes negative; what does is held at 0.
    for (std::size_t step = 0; step <= count; ++step) {
      const Eigen::VectorXd wanted = SolveFree(a, b, is_free);
      double reach = 1;
      for (std::size_t k = 0; k < count; ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        if (is_free[k] && wanted(at) <= 0) {
          reach = std::min(reach, x(at) / (x(at) - wanted(at)));
        }
      }
      if (reach >= 1) {
        x = wanted;
        break;
      }
      x += std::max(0.0, reach) * (wanted - x);
      for (std::size_t k = 0; k < count; ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        if (is_free[k] && x(at) <= 1e-14 * x.cwiseAbs().maxCoeff()) {
          is_free[k] = false;
          x(at) = 0;
        }
      }
    }
  }
  return x;
}

}  // namespace nacre::reconstruct::internal

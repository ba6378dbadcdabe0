#include "factor/internal/nonnegative_solve.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <vector>

namespace nacre::factor::internal {
namespace {

// The unconstrained solution of the unknowns in `free`, others 0. Columns are scaled to
// a unit diagonal, and a ridge of rounding's size keeps what nearly coincides apart.
Eigen::VectorXd SolveFree(const Eigen::MatrixXd& gram,
                          const Eigen::VectorXd& cross,
                          const std::vector<Eigen::Index>& free) {
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd a(n, n);
  Eigen::VectorXd b(n);
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index from = free[static_cast<std::size_t>(i)];
    scale(i) = 1 / std::sqrt(gram(from, from));
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index row = free[static_cast<std::size_t>(i)];
    b(i) = cross(row) * scale(i);
    for (Eigen::Index j = 0; j < n; ++j) {
      a(i, j) = gram(row, free[static_cast<std::size_t>(j)]) * scale(i) * scale(j);
    }
  }
  a.diagonal().array() += 1e-13;
  const Eigen::VectorXd solved = a.ldlt().solve(b).cwiseProduct(scale);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(cross.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    x(free[static_cast<std::size_t>(i)]) = solved(i);
  }
  return x;
}

}  // namespace

Eigen::VectorXd SolveNonnegative(const Eigen::MatrixXd& gram,
                                 const Eigen::VectorXd& cross) {
  const Eigen::Index n = cross.size();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Index> free;
  // Each round frees the unknown that gains most; 3 n rounds are plenty.
  for (Eigen::Index round = 0; round < 3 * n; ++round) {
    const Eigen::VectorXd slope = cross - gram * x;
    Eigen::Index best = -1;
    double gain = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      const bool is_free = std::find(free.begin(), free.end(), j) != free.end();
      if (!is_free && gram(j, j) > 0 && slope(j) > 1e-12 * std::abs(cross(j)) &&
          slope(j) * slope(j) / gram(j, j) > gain) {
        gain = slope(j) * slope(j) / gram(j, j);
        best = j;
      }
    }
    if (best < 0) {
      break;
    }
    free.push_back(best);
    Eigen::VectorXd wanted = SolveFree(gram, cross, free);
    // Towards the solution as far as nothing turns negative; what does leaves.
    while (wanted.minCoeff() < 0) {
      double step = 1;
      Eigen::Index blocking = free.front();
      for (const Eigen::Index j : free) {
        if (wanted(j) < 0 && x(j) / (x(j) - wanted(j)) <= step) {
          step = x(j) / (x(j) - wanted(j));
          blocking = j;
        }
      }
      x += step * (wanted - x);
      x(blocking) = 0;
      std::erase(free, blocking);
      wanted = SolveFree(gram, cross, free);
    }
    x = wanted;
  }
  return x;
}

}  // namespace nacre::factor::internal

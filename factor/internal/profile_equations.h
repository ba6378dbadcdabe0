#pragma once

#include "factor/internal/nonnegative_solve.h"
#include "factor/internal/profiles_fit.h"

#include <Eigen/Core>

#include <array>

namespace nacre::factor::internal {

/// The Gaussians' values at an offset.
using GaussianValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostGaussians, 1>;

/// The normal equations of one nonnegative sum of Gaussians.
struct ProfileEquations {
  Eigen::Index terms;
  std::array<double, kMostGaussians * kMostGaussians> gram{};  ///< the lower triangle
  std::array<double, kMostGaussians> cross{};

  explicit ProfileEquations(Eigen::Index term_count) : terms(term_count) {}

  void Add(const GaussianValues& a, double value, double weight) {
    for (Eigen::Index i = 0; i < terms; ++i) {
      const double weighted = weight * a(i);
      for (Eigen::Index j = 0; j <= i; ++j) {
        gram[static_cast<std::size_t>(i * kMostGaussians + j)] += weighted * a(j);
      }
      cross[static_cast<std::size_t>(i)] += weighted * value;
    }
  }
  /// Pulls the unknowns towards `prior`.
  void AddPrior(const GaussianValues& strength, const GaussianValues& prior) {
    for (Eigen::Index i = 0; i < terms; ++i) {
      gram[static_cast<std::size_t>(i * (kMostGaussians + 1))] += strength(i);
      cross[static_cast<std::size_t>(i)] += strength(i) * prior(i);
    }
  }
  Eigen::MatrixXd Gram() const {
    Eigen::MatrixXd full(terms, terms);
    for (Eigen::Index i = 0; i < terms; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        full(i, j) = full(j, i) =
            gram[static_cast<std::size_t>(i * kMostGaussians + j)];
      }
    }
    return full;
  }
  Eigen::VectorXd Cross() const {
    return Eigen::Map<const Eigen::VectorXd>(cross.data(), terms);
  }
  Eigen::VectorXd Solve() const { return SolveNonnegative(Gram(), Cross()); }
};

}  // namespace nacre::factor::internal

#pragma once

#include "factor/internal/truncated_svd.h"
#include "factor/internal/workers.h"

#include <cstdint>

namespace nacre::factor::internal {

/// Y ≈ F H with no negative number in either.
struct Nonnegative {
  Eigen::MatrixXd f;  ///< rows × terms
  RowMatrix h;        ///< terms × columns
  int rounds = 0;
};

/// One sweep of hierarchical alternating least squares over the columns of `f`: each in
/// turn becomes the nonnegative least-squares solution given the others [Cichocki09,
/// eq. 16], for ‖Y − F H‖² with `gram` = H Hᵀ and `cross` = Y Hᵀ. The error never
/// rises.
void HalsSweep(const Eigen::MatrixXd& gram,
               const Eigen::MatrixXd& cross,
               Eigen::MatrixXd& f);

/// F and H of at most `terms` terms, the error not falling by 1e-5 a round any more or
/// after `rounds`. H starts as the rows of `start`, then rows of Y that lie far apart,
/// chosen by `seed`. Negative entries of Y count, but nothing follows them below zero.
/// Rows of F are shared by threads and ranks; all get all.
struct NonnegativeOptions {
  int terms = 1;
  int rounds = 200;
  std::uint64_t seed = 1;
  Workers workers = {};
};
Nonnegative FactorNonnegative(const RowMatrix& y,
                              const RowMatrix& start,
                              const NonnegativeOptions& options);

}  // namespace nacre::factor::internal

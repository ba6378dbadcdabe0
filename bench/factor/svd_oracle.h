#pragma once

#include "factor/internal/block_svd.h"
#include "factor/internal/row_transform.h"
#include "reconstruct/rd_dataset.h"

#include <Eigen/Core>

namespace nacre::bench {

/// The truncated SVD to the precision of doubles.
struct Oracle {
  Eigen::MatrixXd vectors;  ///< columns × terms
  double squares = 0;       ///< Σ y²
  double error = 0;         ///< ‖Y − Y_S‖ / ‖Y‖
};

/// YᵀY by OpenBLAS's dsyrk, its leading eigenvectors by LAPACK's dsyevr.
Oracle ExactSvd(const reconstruct::RdDataset& data,
                const factor::internal::RowTransform& transform,
                int terms);

struct Difference {
  double excess = 0;          ///< ‖Y − Ŷ‖ / ‖Y − Y_S‖ − 1
  double reconstruction = 0;  ///< ‖Ŷ − Y_S‖ / ‖Y_S‖
};

Difference Compare(const reconstruct::RdDataset& data,
                   const factor::internal::RowTransform& transform,
                   const Oracle& exact,
                   const factor::internal::BlockSvd& svd);

/// The relative error of LAPACK's sgesdd, cut after `terms`.
double LapackError(const reconstruct::RdDataset& data,
                   const factor::internal::RowTransform& transform,
                   int terms);

}  // namespace nacre::bench

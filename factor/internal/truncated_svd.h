#pragma once

#include <Eigen/Core>

namespace nacre::factor::internal {

/// Rows are slices; row-major, as slices are stored.
using RowMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The leading eigenpairs of a symmetric positive semidefinite matrix, largest first.
struct LeadingEigen {
  Eigen::VectorXd values;   ///< ≥ 0
  Eigen::MatrixXd vectors;  ///< columns, orthonormal
};

/// Returns at most `count` pairs: fewer if the rest is zero to rounding, which is said
/// of values below kRankTolerance² of the largest; none for a matrix of zeros. Only the
/// lower triangle is read. `tolerance` bounds the residual |Gx − λx| over the trace.
/// Deterministic.
LeadingEigen ComputeLeadingEigen(const Eigen::MatrixXd& gram,
                                 int count,
                                 double tolerance = 1e-13);

/// The same one after the other, each from what is left of G without those before: for
/// G = YᵀY, the thesis' loop over the residual Y − Σ f_j h_jᵀ [Oenel14, sec. 4.3].
LeadingEigen DeflateEigen(const Eigen::MatrixXd& gram, int count);

/// Singular values below this fraction of the largest are taken for zero: measurements
/// are 32-bit floats, so smaller ones hold their rounding only.
inline constexpr double kRankTolerance = 1e-7;

/// Y ≈ scores · basisᵀ, the best approximation of that rank [Eckart36].
struct TruncatedSvd {
  Eigen::VectorXd sigma;   ///< singular values, largest first
  Eigen::MatrixXd scores;  ///< rows × terms: U Σ
  Eigen::MatrixXd basis;   ///< columns × terms, orthonormal, signs canonical
};

/// By the eigenvectors of YᵀY or YYᵀ, whichever is smaller. Sums are in double: data
/// that are floats to begin with lose nothing by the squaring.
TruncatedSvd ComputeTruncatedSvd(const RowMatrix& y,
                                 int terms,
                                 double tolerance = 1e-13);

/// Makes the entry of largest magnitude of each column positive (the first such entry),
/// so that the same data always give the same signs.
void MakeSignsCanonical(Eigen::MatrixXd& vectors);

}  // namespace nacre::factor::internal

#include "factor/internal/block_svd.h"

#include "core/random.h"
#include "factor/internal/row_kernels.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre::factor::internal {
namespace {

constexpr int kMostSamplePasses = 16;
// The sample's own basis is no nearer to that of all rows than a few thousandths.
constexpr double kSampleTolerance = 1e-4;
constexpr double kDependent = 1e-11;  // of U's columns: squared, so rounding of floats
// Of U's columns: what is shorter than that of the longest is rounding of floats.
constexpr double kLeastColumn = 1e-6;
constexpr double kFloat = 6e-8;
// Columns that are nearer to each other than that make more of rounding.
constexpr double kOblique = 0.1;

// The SVD of Y projected on the range of U.
struct Ritz {
  Eigen::VectorXd sigma;
  Eigen::MatrixXd vectors;    // columns × rank
  Eigen::MatrixXd to_scores;  // scores = U · to_scores
  double excess = 0;
  // U's columns had directions in common that floats don't tell from others.
  bool is_cut = false;
};

// `basis` is what the product was made with.
Ritz RayleighRitz(const BlockProduct& product,
                  const Eigen::MatrixXd& basis,
                  Eigen::Index terms) {
  Ritz ritz;
  // U's columns are nearly orthogonal but of very different length: scaled first.
  Eigen::VectorXd scale = product.gram.diagonal().cwiseMax(0).cwiseSqrt();
  const double least = kLeastColumn * scale.maxCoeff();
  for (double& length : scale) {
    length = length > least ? 1 / length : 0;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> angles(
      scale.asDiagonal() * product.gram * scale.asDiagonal());
  Eigen::Index first = 0;
  while (first < scale.size() && !(angles.eigenvalues()(first) > kDependent)) {
    ++first;
  }
  const Eigen::Index rank = scale.size() - first;
  if (rank == 0) {
    return {Eigen::VectorXd(0),
            Eigen::MatrixXd(product.z.rows(), 0),
            Eigen::MatrixXd(scale.size(), 0)};
  }
  ritz.is_cut = first > (scale.array() == 0).count();
  // Q = U orthonormal, B = QᵀY.
  const Eigen::MatrixXd orthonormal =
      scale.asDiagonal() * angles.eigenvectors().rightCols(rank) *
      angles.eigenvalues().tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd transposed = product.z * orthonormal;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(transposed);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner> svd(
      r, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto above =
      (svd.singularValues().array() > kRankTolerance * svd.singularValues()(0));
  const Eigen::Index kept = above.count();
  ritz.sigma = svd.singularValues().head(kept);
  ritz.vectors =
      qr.householderQ() * (Eigen::MatrixXd::Identity(product.z.rows(), rank) *
                           svd.matrixU().leftCols(kept));
  ritz.to_scores = orthonormal * svd.matrixV().leftCols(kept) * ritz.sigma.asDiagonal();

  // To first order Y leaves of a singular vector's part outside V the ratio of the
  // first singular value beyond the block to its own: that much of u_j is outside U's
  // range, and E = ‖Y − Ŷ‖² is above its least by Σ_j σ_j² times its square [Halko11,
  // sec. 9].
  // Beyond the block is what its columns were too short for, if any were. And what
  // rounding of floats in YᵀU comes to in QᵀY.
  const Eigen::Index wanted = std::min(terms, kept);
  const double left = std::max(product.squares - ritz.sigma.head(wanted).squaredNorm(),
                               1e-12 * product.squares);
  const double beyond =
      kept == basis.cols() ? ritz.sigma(kept - 1) : kLeastColumn * ritz.sigma(0);
  const Eigen::MatrixXd leading = ritz.vectors.leftCols(wanted);
  const double outside =
      (leading - basis * (basis.transpose() * leading)).squaredNorm();
  ritz.excess = 0.5 * beyond * beyond * outside / left;
  const double oblique = angles.eigenvalues()(first);
  if (oblique < kOblique) {
    ritz.excess += std::pow(kFloat * ritz.sigma(0), 2) / oblique / left;
  }
  return ritz;
}

Eigen::MatrixXd DrawColumns(Eigen::Index rows, Eigen::Index columns) {
  RandomStream random(1, 0x626C6F636B);
  const auto draw = [&] { return random.Uniform() - 0.5; };
  return Eigen::MatrixXd::NullaryExpr(rows, columns, draw);
}

Eigen::MatrixXd Orthonormal(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

// A basis of whole panels, the rest zero.
Eigen::MatrixXd Padded(const Eigen::MatrixXd& vectors, Eigen::Index size) {
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(vectors.rows(), size);
  basis.leftCols(vectors.cols()) = vectors;
  return basis;
}

// The rest drawn at random, orthogonal to the vectors: of what singular values fall by
// more decades than floats have digits, one product shows the largest alone, and the
// next, without them, what is below.
Eigen::MatrixXd Filled(const Eigen::MatrixXd& vectors, Eigen::Index size) {
  const Eigen::Index count = std::min(size, vectors.rows()) - vectors.cols();
  Eigen::MatrixXd drawn = DrawColumns(vectors.rows(), count);
  for (int twice = 0; twice < 2; ++twice) {
    drawn -= vectors * (vectors.transpose() * drawn).eval();
  }
  Eigen::MatrixXd basis = Padded(vectors, size);
  basis.middleCols(vectors.cols(), count) = Orthonormal(drawn);
  return basis;
}

BlockSvd ToSvd(const BlockProduct& product, Ritz ritz, Eigen::Index terms) {
  BlockSvd svd;
  const Eigen::Index rank = std::min(terms, ritz.sigma.size());
  svd.sigma = ritz.sigma.head(rank);
  svd.vectors = ritz.vectors.leftCols(rank);
  const Eigen::MatrixXd unsigned_vectors = svd.vectors;
  MakeSignsCanonical(svd.vectors);
  for (Eigen::Index j = 0; j < rank; ++j) {
    if (svd.vectors.col(j).dot(unsigned_vectors.col(j)) < 0) {
      ritz.to_scores.col(j) = -ritz.to_scores.col(j);
    }
  }
  const Eigen::Index size = product.gram.rows();
  const auto rows = static_cast<Eigen::Index>(product.u.size()) / size;
  using FloatRows =
      Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  svd.scores.assign(static_cast<std::size_t>(rows * rank), 0.0F);
  Eigen::Map<FloatRows> scores(svd.scores.data(), rows, rank);
  for (Eigen::Index panel = 0; panel < size / kPanel; ++panel) {
    const Eigen::Map<const FloatRows> u(
        product.u.data() + panel * rows * kPanel, rows, kPanel);
    scores.noalias() +=
        u * ritz.to_scores.block(panel * kPanel, 0, kPanel, rank).cast<float>();
  }
  svd.mean = ritz.to_scores.leftCols(rank).transpose() * product.sum /
             static_cast<double>(std::max<Eigen::Index>(rows, 1));
  svd.squares = product.squares;
  svd.excess = ritz.excess;
  return svd;
}

}  // namespace

void BlockSvdSolver::Start(const reconstruct::RdHeader& header) {
  const Eigen::Index columns = header.WindowSize();
  const Eigen::Index size = PaddedColumns(options_.terms + options_.spare);
  const Eigen::MatrixXd start =
      Orthonormal(DrawColumns(columns, std::min(size, columns)));
  bases_.assign(channels_.size(), Padded(start, size));
}

void BlockSvdSolver::SolveSample(SliceSource& sample,
                                 const ProgressFunction& progress) {
  const Eigen::Index size = bases_.front().cols();
  for (int pass = 0; pass < kMostSamplePasses; ++pass) {
    const std::vector<BlockProduct> products = RunBlockPass(
        sample, {fill_, channels_, bases_}, options_.workers, progress, "sample");
    double excess = 0;
    bool is_cut = false;
    for (std::size_t n = 0; n < products.size(); ++n) {
      const Ritz ritz = RayleighRitz(products[n], bases_[n], options_.terms);
      bases_[n] = ritz.is_cut ? Filled(ritz.vectors, size) : Padded(ritz.vectors, size);
      excess = std::max(excess, ritz.excess);
      is_cut = is_cut || ritz.is_cut;
    }
    if (excess <= kSampleTolerance && !is_cut) {
      return;
    }
  }
}

BlockSvds BlockSvdSolver::Solve(SliceSource& sample,
                                SliceSource& source,
                                const ProgressFunction& progress) {
  Start(source.header());
  SolveSample(sample, progress);
  BlockSvds result;
  const Eigen::Index size = bases_.front().cols();
  while (true) {
    const std::vector<BlockProduct> products = RunBlockPass(
        source, {fill_, channels_, bases_}, options_.workers, progress, "products");
    ++result.passes;
    result.svds.clear();
    double excess = 0;
    for (std::size_t n = 0; n < products.size(); ++n) {
      Ritz ritz = RayleighRitz(products[n], bases_[n], options_.terms);
      bases_[n] = Padded(ritz.vectors, size);
      excess = std::max(excess, ritz.excess);
      result.svds.push_back(ToSvd(products[n], std::move(ritz), options_.terms));
      if (changed_) {
        changed_(channels_[n], result.svds.back());
      }
    }
    const bool enough =
        result.passes >= options_.least_passes && excess <= options_.tolerance;
    if (enough || result.passes >= options_.most_passes) {
      return result;
    }
  }
}

}  // namespace nacre::factor::internal

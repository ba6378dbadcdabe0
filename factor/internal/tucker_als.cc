#include "factor/internal/tucker_als.h"

#include <Eigen/Cholesky>

#include <algorithm>

namespace nacre::factor::internal {
namespace {

constexpr int kMostRounds = 200;
constexpr double kEnough = 1e-9;  // of the energy, a round

constexpr double kRankResidual = 1e-12;  // of a window's right singular vectors

// The nearest kernel W of that rank, of norm 1; zero if there is none: W V Vᵀ, where V
// are the leading eigenvectors of WᵀW [Eckart36].
Eigen::VectorXd CutRank(const Eigen::VectorXd& kernel, int core, int rank) {
  Eigen::VectorXd cut = kernel;
  if (rank < core) {
    const Eigen::Map<const RowMatrix> window(kernel.data(), core, core);
    const Eigen::MatrixXd v =
        ComputeLeadingEigen(window.transpose() * window, rank, kRankResidual).vectors;
    Eigen::Map<RowMatrix>(cut.data(), core, core) = window * v * v.transpose();
  }
  const double norm = cut.norm();
  if (norm > 0) {
    cut /= norm;
  }
  return cut;
}

// What is left of Y once it is projected away from the span of `taken`: E = Y (1 − QQᵀ)
// by its Gram matrix.
class Residual {
 public:
  explicit Residual(const Eigen::MatrixXd& gram)
      : gram_(gram), taken_(gram.rows(), 0), energy_(gram.trace()) {}

  // EᵀE h.
  Eigen::VectorXd Apply(const Eigen::VectorXd& h) const {
    return Away(gram_.selfadjointView<Eigen::Lower>() * Away(h));
  }

  Eigen::VectorXd Leading() const {
    Eigen::MatrixXd left = gram_.selfadjointView<Eigen::Lower>();
    if (taken_.cols() > 0) {
      left -= taken_ * (taken_.transpose() * left);
      left -= (left * taken_) * taken_.transpose();
    }
    const LeadingEigen eigen = ComputeLeadingEigen(left, 1, 1e-6);
    return eigen.values.size() > 0 ? Eigen::VectorXd(eigen.vectors.col(0))
                                   : Eigen::VectorXd::Zero(gram_.rows());
  }

  // Returns the energy that the new direction takes; 0 if there is none.
  double Take(const Eigen::VectorXd& h) {
    Eigen::VectorXd direction = Away(h);
    const double length = direction.norm();
    if (!(length > 1e-9)) {
      return 0;
    }
    direction = Away(direction / length).normalized();
    const double taken =
        direction.dot(gram_.selfadjointView<Eigen::Lower>() * direction);
    taken_.conservativeResize(Eigen::NoChange, taken_.cols() + 1);
    taken_.rightCols(1) = direction;
    captured_ += taken;
    return taken;
  }

  double energy() const { return energy_; }
  double captured() const { return captured_; }

 private:
  Eigen::VectorXd Away(const Eigen::VectorXd& h) const {
    return h - taken_ * (taken_.transpose() * h);
  }

  const Eigen::MatrixXd& gram_;
  Eigen::MatrixXd taken_;  // orthonormal
  double energy_;
  double captured_ = 0;
};

Eigen::VectorXd FitTerm(const Residual& residual,
                        int term,
                        int core,
                        const TuckerOptions& options) {
  Eigen::VectorXd h = CutRank(residual.Leading(), core, options.window_rank);
  double before = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const Eigen::VectorXd image = residual.Apply(h);
    const double taken = h.dot(image);  // |E h|²
    if (options.on_round) {
      options.on_round(term, (residual.captured() + taken) / residual.energy());
    }
    if (!(taken - before > kEnough * residual.energy())) {
      break;
    }
    before = taken;
    h = CutRank(image, core, options.window_rank);
  }
  return h;
}

}  // namespace

Eigen::MatrixXd TuckerKernels(const Eigen::MatrixXd& gram,
                              int core,
                              const TuckerOptions& options) {
  Eigen::MatrixXd kernels(gram.rows(), 0);
  Residual residual(gram);
  if (!(residual.energy() > 0)) {
    return kernels;
  }
  for (int term = 0; term < options.terms; ++term) {
    const Eigen::VectorXd h = FitTerm(residual, term, core, options);
    if (!(residual.Take(h) > options.least * residual.energy())) {
      break;
    }
    kernels.conservativeResize(Eigen::NoChange, term + 1);
    kernels.col(term) = h;
  }
  MakeSignsCanonical(kernels);
  return kernels;
}

Eigen::MatrixXd CoordinatesOf(const Eigen::MatrixXd& kernels) {
  const Eigen::MatrixXd normal = kernels.transpose() * kernels;
  return kernels *
         normal.ldlt().solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
}

}  // namespace nacre::factor::internal

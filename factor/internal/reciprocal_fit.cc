#include "factor/internal/reciprocal_fit.h"

#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/truncated_svd.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr int kMostRounds = 16;
constexpr double kLeastStep = 0.2;   // as a share of the whole
constexpr double kMostStep = 4;      // the same
constexpr double kLonger = 1.5;      // steps that are worth another trial
constexpr double kEnough = 0.004;    // two rounds that gain less are the last
constexpr double kLeastSlope = 0.1;  // of the map step's own

// The pair kernels of a channel and cell as a matrix: f(x_i)ᵀ P f(x_o).
Eigen::MatrixXd PairMatrix(const ReciprocalFit& fit, Eigen::Index column) {
  const int terms = fit.Terms();
  Eigen::MatrixXd pairs(terms, terms);
  for (int j = 0; j < terms; ++j) {
    for (int k = j; k < terms; ++k) {
      const double h = fit.h(PairKernel(terms, fit.taps, j, k), column);
      pairs(j, k) = pairs(k, j) = j == k ? 2 * h : h;
    }
  }
  return pairs;
}

// Puts f = A g + m: maps become g, and kernels what they have to for the same model.
void ChangeMaps(const Eigen::MatrixXd& a,
                const Eigen::VectorXd& m,
                const SharedMaps& g,
                ReciprocalFit& fit) {
  const int terms = fit.Terms();
  for (Eigen::Index column = 0; column < fit.h.cols(); ++column) {
    const Eigen::MatrixXd pairs = PairMatrix(fit, column);
    auto h = fit.h.col(column);
    h(0) += m.dot(pairs * m);
    for (int tap = 0; tap < fit.taps; ++tap) {
      auto kernel = h.segment(TapKernel(terms, tap, 0), terms);
      h(0) += 2 * kernel.dot(m);  // weights of a tap add up to 2
      Eigen::VectorXd changed = kernel;
      if (tap == 0) {
        changed += pairs * m;
      }
      kernel = a.transpose() * changed;
    }
    const Eigen::MatrixXd turned = a.transpose() * pairs * a;
    for (int j = 0; j < terms; ++j) {
      for (int k = j; k < terms; ++k) {
        h(PairKernel(terms, fit.taps, j, k)) =
            j == k ? 0.5 * turned(j, k) : turned(j, k);
      }
    }
  }
  fit.f = g;
}

// Maps times a triangular matrix's inverse.
SharedMaps Unmixed(const Eigen::MatrixXd& root, const SharedMaps& maps) {
  return root.triangularView<Eigen::Lower>()
      .solve(maps.cast<double>().eval())
      .cast<float>();
}

// Mean 0, mean products the identity over the grid. A ridge keeps maps that depend on
// each other from blowing up. Returns what the maps, their mean taken off, were
// multiplied by the inverse of.
Eigen::MatrixXd Whiten(const ReciprocalData& data, ReciprocalFit& fit) {
  const Eigen::Index terms = fit.f.rows();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(terms);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(terms, terms);
  for (int y = data.margin; y < data.height - data.margin; ++y) {
    const Eigen::MatrixXd row =
        fit.f.middleCols(y * data.width + data.margin, data.width - 2 * data.margin)
            .cast<double>();
    mean += row.rowwise().sum();
    products.noalias() += row * row.transpose();
  }
  const double points =
      (data.width - 2.0 * data.margin) * (data.height - 2.0 * data.margin);
  mean /= points;
  products = products / points - mean * mean.transpose();
  products.diagonal().array() += 1e-9 * products.trace() + 1e-30;
  Eigen::MatrixXd root = products.llt().matrixL();
  const SharedMaps white = root.triangularView<Eigen::Lower>()
                               .solve((fit.f.cast<double>().colwise() - mean).eval())
                               .cast<float>();
  ChangeMaps(root, mean, white, fit);
  return root;
}

// Turns the maps so that each contributes as much as possible after those before it.
void MakeCanonical(const ReciprocalData& data, ReciprocalFit& fit) {
  const int terms = fit.Terms();
  Eigen::MatrixXd energy = Eigen::MatrixXd::Zero(terms, terms);
  for (Eigen::Index column = 0; column < fit.h.cols(); ++column) {
    const double weight =
        std::max(data.mean[static_cast<std::size_t>(column)], 0.0) + 1e-6;
    for (int tap = 0; tap < fit.taps; ++tap) {
      const Eigen::VectorXd kernel =
          fit.h.col(column).segment(TapKernel(terms, tap, 0), terms);
      energy += weight * kernel * kernel.transpose();
    }
    const Eigen::MatrixXd pairs = PairMatrix(fit, column);
    energy += weight * pairs * pairs.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(energy);
  Eigen::MatrixXd turn = solver.eigenvectors().rowwise().reverse();
  Eigen::MatrixXd turned = (turn.transpose() * fit.f.cast<double>()).transpose();
  const Eigen::MatrixXd before = turned;
  MakeSignsCanonical(turned);
  for (int j = 0; j < terms; ++j) {
    if (turned.col(j).dot(before.col(j)) < 0) {
      turn.col(j) *= -1;
    }
  }
  ChangeMaps(turn,
             Eigen::VectorXd::Zero(terms),
             SharedMaps(turned.transpose().cast<float>()),
             fit);
}

// Nonlinear conjugate gradients on the error as a function of the maps alone, kernels
// being what fits them best; the Gauss–Newton step of the maps is the preconditioned
// gradient [DeSterck15, with the β of Polak and Ribière]. Alternating steps by
// themselves crawl along valleys where maps and kernels have to change together.
class MapDescent {
 public:
  MapDescent(const ReciprocalData& data, const Workers& workers, double error)
      : data_(data), workers_(workers), error_(error) {}

  double error() const { return error_; }

  // False if no step lowers the error.
  bool Round(ReciprocalFit& fit) {
    ++fit.rounds;
    const MapChange now = MapStep(data_, fit, workers_);
    const double own_slope = Dot(now.pull, now.step);
    SharedMaps along = now.step;
    double slope = own_slope;
    if (last_slope_ > 0) {
      const double beta =
          std::max(0.0, (own_slope - Dot(now.pull, last_step_)) / last_slope_);
      along += static_cast<float>(beta) * last_along_;
      slope = Dot(now.pull, along);
    }
    const bool is_plain = !(last_slope_ > 0) || !(slope > kLeastSlope * own_slope);
    if (is_plain) {
      along = now.step;
      slope = own_slope;
    }
    Trial best = Search(fit, along, slope);
    if (!(best.error < error_)) {
      last_slope_ = 0;
      return !is_plain;  // the plain step is still to be tried
    }
    error_ = best.error;
    fit = std::move(best.fit);
    last_slope_ = own_slope;
    last_step_ = Unmixed(best.root, now.step);
    last_along_ = Unmixed(best.root, static_cast<float>(best.length) * along);
    return true;
  }

 private:
  struct Trial {
    ReciprocalFit fit;
    Eigen::MatrixXd root;
    double length = 0;
    double error = 0;
  };

  Trial Try(const ReciprocalFit& fit, const SharedMaps& along, double length) const {
    Trial trial{fit, {}, length, 0};
    trial.fit.f += static_cast<float>(length) * along;
    trial.root = Whiten(data_, trial.fit);
    trial.error =
        SolveReciprocalKernels(data_, KernelStart::kGoOn, false, workers_, trial.fit);
    return trial;
  }

  // The whole step; if it is no good, halves of it; if a parabola says that a longer
  // one is better, that.
  Trial Search(const ReciprocalFit& fit, const SharedMaps& along, double slope) const {
    Trial best = Try(fit, along, 1);
    if (best.error < error_) {
      const double curvature = best.error - error_ + 2 * slope;
      const double length =
          curvature > slope / kMostStep ? slope / curvature : kMostStep;
      if (length > kLonger) {
        Trial longer = Try(fit, along, length);
        if (longer.error < best.error) {
          return longer;
        }
      }
      return best;
    }
    for (double length = 0.5; length > kLeastStep && !(best.error < error_);
         length /= 2) {
      best = Try(fit, along, length);
    }
    return best;
  }

  const ReciprocalData& data_;
  Workers workers_;
  double error_;
  double last_slope_ = 0;  // 0: no direction to go on in
  SharedMaps last_step_;
  SharedMaps last_along_;
};

}  // namespace

ReciprocalFit FitReciprocal(ReciprocalData& data,
                            const SharedMaps& start,
                            int taps,
                            const Workers& workers,
                            const ProgressFunction& progress) {
  ReciprocalFit fit{.f = start, .taps = taps, .h = {}};
  Whiten(data, fit);
  double least =
      SolveReciprocalKernels(data, KernelStart::kLogarithms, true, workers, fit);
  if (!data.has_weights) {
    SetHeldWeights(fit, workers.thread_count, data);
    SetSampleWeights(fit, workers.thread_count, data);
    data.has_weights = true;
    least = SolveReciprocalKernels(data, KernelStart::kGoOn, false, workers, fit);
  }
  MapDescent descent(data, workers, least);
  for (int small = 0; fit.rounds < kMostRounds && small < 2;) {
    Report(progress, {"factor", fit.rounds, kMostRounds, "alternating"});
    const double before = descent.error();
    if (!descent.Round(fit)) {
      break;
    }
    small = descent.error() > (1 - kEnough) * before ? small + 1 : 0;
  }
  MakeCanonical(data, fit);
  SolveReciprocalKernels(data, KernelStart::kLogarithms, true, workers, fit);
  return fit;
}

}  // namespace nacre::factor::internal

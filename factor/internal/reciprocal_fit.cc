#include "factor/internal/reciprocal_fit.h"

#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/truncated_svd.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr int kMostRounds = 12;
constexpr double kLeastStep = 0.2;  // as a share of the whole
constexpr double kEnough = 0.01;    // a round that gains less is the last

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

// Mean 0, mean products the identity over the grid. A ridge keeps maps that depend on
// each other from blowing up.
void Whiten(const ReciprocalData& data, ReciprocalFit& fit) {
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
  const Eigen::MatrixXd root = products.llt().matrixL();
  const SharedMaps white = root.triangularView<Eigen::Lower>()
                               .solve((fit.f.cast<double>().colwise() - mean).eval())
                               .cast<float>();
  ChangeMaps(root, mean, white, fit);
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

}  // namespace

ReciprocalFit FitReciprocal(ReciprocalData& data,
                            const SharedMaps& start,
                            int taps,
                            int thread_count,
                            const ProgressFunction& progress) {
  ReciprocalFit fit{.f = start, .taps = taps, .h = {}};
  Whiten(data, fit);
  double least =
      SolveReciprocalKernels(data, KernelStart::kLogarithms, true, thread_count, fit);
  if (!data.has_weights) {
    SetHeldWeights(fit, thread_count, data);
    SetSampleWeights(fit, thread_count, data);
    data.has_weights = true;
    least = SolveReciprocalKernels(data, KernelStart::kGoOn, false, thread_count, fit);
  }
  double gained = 1;
  while (fit.rounds < kMostRounds && gained > kEnough) {
    Report(progress, {"factor", fit.rounds, kMostRounds, "alternating"});
    const SharedMaps step = MapStep(data, fit, thread_count);
    ReciprocalFit next;
    double error = least;
    for (float length = 1; length > static_cast<float>(kLeastStep); length /= 2) {
      next = fit;
      next.f += length * step;
      Whiten(data, next);
      error =
          SolveReciprocalKernels(data, KernelStart::kGoOn, false, thread_count, next);
      if (error < least) {
        break;
      }
    }
    ++fit.rounds;
    if (!(error < least)) {
      break;
    }
    gained = 1 - error / least;
    least = error;
    next.rounds = fit.rounds;
    fit = std::move(next);
  }
  MakeCanonical(data, fit);
  SolveReciprocalKernels(data, KernelStart::kLogarithms, true, thread_count, fit);
  return fit;
}

}  // namespace nacre::factor::internal

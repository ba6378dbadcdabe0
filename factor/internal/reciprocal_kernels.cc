// Kernels of the reciprocal model, given its maps.

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/reciprocal_fit.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/row_streams.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr int kLastSteps = 3;      // Gauss–Newton
constexpr double kRidge = 1e-4;    // of each kernel's own diagonal
constexpr double kMostChange = 2;  // of a logarithm, in one step
constexpr double kLeastShare = 0.02;
constexpr double kLeast = 1e-60;  // peaks: zero as a float

// The pairs of an offset that kernels are fitted to: the first points' indices, and
// where their values begin.
struct KernelSample {
  std::vector<std::size_t> at;     // in the plane
  std::vector<std::size_t> value;  // of channel 0
  std::size_t channel_step = 0;
  const Pairs* pairs = nullptr;
};

KernelSample SampleOf(const ReciprocalData& data, std::size_t cell) {
  KernelSample sample;
  const bool is_plane = data.HoldsAll();
  std::size_t base = 0;
  if (is_plane) {
    const auto found =
        std::find(data.held.begin(), data.held.end(), static_cast<int>(cell));
    base = data.HeldOffset(0, static_cast<std::size_t>(found - data.held.begin()));
    sample.channel_step = data.HeldOffset(1, 0);
    sample.pairs = &data.pairs;
  } else {
    base = data.SampleOffset(0, cell);
    sample.channel_step = data.SampleOffset(1, 0);
    sample.pairs = &data.sample;
  }
  const PlaneArea area = AreaOf(data, cell);
  const auto width = static_cast<std::size_t>(data.width);
  std::size_t n = 0;
  for (std::size_t p = cell % data.stride; p < data.Plane(); p += data.stride, ++n) {
    const auto x = static_cast<int>(p % width);
    const auto y = static_cast<int>(p / width);
    if (x >= area.x0 && x < area.x1 && y >= area.y0 && y < area.y1) {
      sample.at.push_back(p);
      sample.value.push_back(base + (is_plane ? p : p / data.stride));
    }
  }
  return sample;
}

// What kernels multiply: a row a pair.
Eigen::MatrixXd Design(const ReciprocalData& data,
                       const ReciprocalFit& fit,
                       std::size_t cell,
                       const std::vector<std::size_t>& pairs) {
  const int terms = fit.Terms();
  const int du = data.OffsetX(cell);
  const int dv = data.OffsetY(cell);
  const auto to = static_cast<Eigen::Index>(dv) * data.width + du;
  const std::vector<TapPoint> taps = TapPoints(du, dv, fit.taps);
  Eigen::MatrixXd design =
      Eigen::MatrixXd::Zero(std::ssize(pairs), ReciprocalKernelCount(terms, fit.taps));
  design.col(0).setOnes();
  for (int j = 0; j < terms; ++j) {
    for (Eigen::Index n = 0; n < design.rows(); ++n) {
      const auto p = static_cast<Eigen::Index>(pairs[static_cast<std::size_t>(n)]);
      const auto value = [&](int term, Eigen::Index at) {
        return static_cast<double>(fit.f(term, at));
      };
      design(n, TapKernel(terms, 0, j)) = value(j, p) + value(j, p + to);
      for (const TapPoint& tap : taps) {
        design(n, TapKernel(terms, tap.tap, j)) +=
            static_cast<double>(tap.weight) *
            value(j, p + static_cast<Eigen::Index>(tap.dy) * data.width + tap.dx);
      }
      for (int k = j; k < terms; ++k) {
        design(n, PairKernel(terms, fit.taps, j, k)) =
            value(j, p) * value(k, p + to) + value(k, p) * value(j, p + to);
      }
    }
  }
  return design;
}

struct Target {
  Eigen::VectorXd value;
  Eigen::VectorXd weight;
};

// What was measured, and the weights of errors in R_d.
Target TargetOf(const ReciprocalData& data,
                const KernelSample& sample,
                std::size_t channel,
                double tolerance) {
  const auto count = std::ssize(sample.at);
  Target target{Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count)};
  for (Eigen::Index n = 0; n < count; ++n) {
    const std::size_t at =
        sample.value[static_cast<std::size_t>(n)] + channel * sample.channel_step;
    const auto weight = static_cast<double>(sample.pairs->weight[at]);
    target.value(n) = static_cast<double>(sample.pairs->value[at]);
    if (!data.has_weights) {
      target.weight(n) = weight < 0 ? 0 : 1 / (weight + tolerance);
    } else {
      target.weight(n) = weight;
    }
  }
  return target;
}

// Least squares with a ridge that is small against each unknown's own share.
Eigen::VectorXd Solve(const Eigen::MatrixXd& design,
                      const Eigen::VectorXd& weight,
                      const Eigen::VectorXd& target) {
  Eigen::MatrixXd normal(design.cols(), design.cols());
  WeightedGram(design.data(),
               weight.data(),
               static_cast<std::size_t>(design.rows()),
               static_cast<std::size_t>(design.cols()),
               normal.data());
  const double least = 1e-12 * normal.diagonal().maxCoeff() + 1e-300;
  const Eigen::VectorXd scale = (normal.diagonal().array() + least).rsqrt();
  normal = scale.asDiagonal() * normal * scale.asDiagonal();
  normal.diagonal().array() += kRidge;
  normal(0, 0) -= 0.99 * kRidge;  // the constant isn't to be pulled to 0
  const Eigen::VectorXd right =
      scale.cwiseProduct(design.transpose() * weight.cwiseProduct(target));
  return scale.cwiseProduct(normal.selfadjointView<Eigen::Lower>().ldlt().solve(right));
}

double ErrorOf(const Target& target, const Eigen::VectorXd& s) {
  const Eigen::ArrayXd modelled = s.array().min(kMostLog).exp();
  return (target.weight.array() * (target.value.array() - modelled).square()).sum();
}

// Kernels for the logarithms: errors of ln R_d times R_d are those of R_d.
Eigen::VectorXd FromLogarithms(const Eigen::MatrixXd& design,
                               const Target& target,
                               double mean,
                               double noise) {
  const double least = std::max({2 * noise, kLeastShare * mean, kLeast});
  const Eigen::ArrayXd value = target.value.array().max(least);
  return Solve(design, target.weight.array() * value.square(), value.log());
}

// Returns the error that is left.
double Refine(const Eigen::MatrixXd& design,
              const Target& target,
              int steps,
              Eigen::VectorXd& h) {
  Eigen::VectorXd s = design * h;
  double error = ErrorOf(target, s);
  for (int step = 0; step < steps; ++step) {
    const Eigen::ArrayXd modelled = s.array().min(kMostLog).exp().max(1e-30);
    const Eigen::ArrayXd change = ((target.value.array() - modelled) / modelled)
                                      .max(-kMostChange)
                                      .min(kMostChange);
    const Eigen::VectorXd solved =
        Solve(design, target.weight.array() * modelled.square(), s.array() + change);
    Eigen::VectorXd next = solved;
    double now = ErrorOf(target, design * next);
    for (int halving = 0; halving < 4 && !(now <= error); ++halving) {
      next = 0.5 * (next + h);
      now = ErrorOf(target, design * next);
    }
    if (!(now < error)) {
      break;
    }
    const bool is_last = now > (1 - 1e-4) * error;
    error = now;
    h = next;
    s = design * h;
    if (is_last) {
      break;
    }
  }
  return error;
}

// How a column's kernels are begun with.
struct ColumnStart {
  KernelStart from;
  int steps;  // Gauss–Newton
  Eigen::VectorXd h;
};

// Kernels of a channel and cell, from `h` on; after them stands the error that is left.
Eigen::VectorXd SolveColumn(const ReciprocalData& data,
                            const Eigen::MatrixXd& design,
                            const Target& target,
                            const ColumnStart& start,
                            std::size_t column) {
  Eigen::VectorXd h = start.h;
  double error = 0;
  if (!(target.weight.sum() > 0)) {  // never measured
    h.setZero();
    h(0) = std::log(std::max(data.mean[column], kLeast));
  } else {
    if (start.from == KernelStart::kLogarithms) {
      const Eigen::VectorXd fresh =
          FromLogarithms(design, target, data.mean[column], data.noise[column]);
      if (h.isZero(0) ||
          ErrorOf(target, design * fresh) < ErrorOf(target, design * h)) {
        h = fresh;
      }
    }
    error = Refine(design, target, start.steps, h);
  }
  Eigen::VectorXd solved(h.size() + 1);
  solved << h, error;
  return solved;
}

}  // namespace

double SolveReciprocalKernels(const ReciprocalData& data,
                              KernelStart start,
                              bool all_cells,
                              const Workers& workers,
                              ReciprocalFit& fit) {
  const int kernels = ReciprocalKernelCount(fit.Terms(), fit.taps);
  if (fit.h.rows() != kernels) {
    fit.h = Eigen::MatrixXd::Zero(
        kernels, static_cast<Eigen::Index>(data.channels * data.cells));
  }
  const std::size_t count = all_cells ? data.cells : data.held.size();
  const auto cell_of = [&](std::size_t n) {
    return all_cells ? n : static_cast<std::size_t>(data.held[n]);
  };
  // A column a cell and channel: its kernels, and the error that is left.
  Eigen::MatrixXd solved = Eigen::MatrixXd::Zero(
      kernels + 1, static_cast<Eigen::Index>(count * data.channels));
  const RankShare share = ShareOf(static_cast<std::int64_t>(count), workers.ranks);
  ParallelFor(share.end - share.begin, workers.thread_count, [&](std::int64_t own) {
    const auto n = static_cast<std::size_t>(share.begin + own);
    const KernelSample sample = SampleOf(data, cell_of(n));
    const Eigen::MatrixXd design = Design(data, fit, cell_of(n), sample.at);
    for (std::size_t c = 0; c < data.channels; ++c) {
      const std::size_t column = c * data.cells + cell_of(n);
      const Target target =
          TargetOf(data, sample, c, Tolerance(data.mean[column], data.tail_weight));
      solved.col(static_cast<Eigen::Index>(n * data.channels + c)) =
          SolveColumn(data,
                      design,
                      target,
                      {start,
                       all_cells ? kLastSteps : 1,
                       fit.h.col(static_cast<Eigen::Index>(column))},
                      column);
    }
  });
  JoinShares(static_cast<std::int64_t>(count),
             workers.ranks,
             std::span(solved.data(), static_cast<std::size_t>(solved.size())));
  double sum = 0;
  for (Eigen::Index at = 0; at < solved.cols(); ++at) {
    const std::size_t n = static_cast<std::size_t>(at) / data.channels;
    const std::size_t c = static_cast<std::size_t>(at) % data.channels;
    fit.h.col(static_cast<Eigen::Index>(c * data.cells + cell_of(n))) =
        solved.col(at).head(kernels);
    sum += solved(kernels, at) * (all_cells ? 1.0 : static_cast<double>(data.share[n]));
  }
  return sum;
}

void SetSampleWeights(const ReciprocalFit& fit,
                      int thread_count,
                      ReciprocalData& data) {
  if (data.HoldsAll()) {
    return;
  }
  ParallelFor(
      static_cast<std::int64_t>(data.cells), thread_count, [&](std::int64_t cell) {
        const auto n = static_cast<std::size_t>(cell);
        const KernelSample sample = SampleOf(data, n);
        const Eigen::MatrixXd design = Design(data, fit, n, sample.at);
        for (std::size_t c = 0; c < data.channels; ++c) {
          const Eigen::VectorXd s =
              design * fit.h.col(static_cast<Eigen::Index>(c * data.cells + n));
          float* weight = &data.sample.weight[c * sample.channel_step];
          for (Eigen::Index p = 0; p < s.size(); ++p) {
            float& w = weight[sample.value[static_cast<std::size_t>(p)]];
            w = WeightOf(w, std::exp(std::min(s(p), kMostLog)), data.tail_weight);
          }
        }
      });
}

}  // namespace nacre::factor::internal

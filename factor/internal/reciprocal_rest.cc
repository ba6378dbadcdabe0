// What pairs of points have beside the maps at their ends and between.

#include "factor/internal/reciprocal_rest.h"

#include "core/parallel.h"
#include "factor/internal/reciprocal_rows.h"
#include "factor/internal/truncated_svd.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace nacre::factor::internal {
namespace {

constexpr int kTurns = 2;                // linearizations
constexpr int kRounds = 6;               // of expectation maximization
constexpr std::int64_t kBlock = 256;     // points at a time
constexpr std::int64_t kSampled = 4096;  // points that the first basis is of
constexpr double kMisfit = 0.01;         // of the tolerance, squared: noise at least
constexpr double kKernelPrior = 100;     // inverse variance of kernels
constexpr double kKernelRidge = 1e-3;    // of a kernel's own diagonal

// Errors of the held pairs over their noise, and what they change by with the
// logarithm of R_d: planes, as those of data.pairs. 0 where nothing was measured.
struct Whitened {
  std::vector<float> error;
  std::vector<float> slope;
};

// What noise is of a column's weighted errors. A tenth of the tolerance counts as
// noise.
double NoiseOf(const ReciprocalData& data, std::size_t channel, int cell) {
  const std::size_t n = channel * data.cells + static_cast<std::size_t>(cell);
  const double tolerance = Tolerance(data.mean[n], data.tail_weight);
  // Most pairs have two measurements.
  const double noise = 0.5 * data.noise[n] * data.noise[n];
  return std::sqrt((noise + kMisfit * tolerance) / (noise + tolerance));
}

// The largest share of sigma in what counts as a column's noise.
double KnownNoise(const ReciprocalData& data) {
  double largest = 0;
  for (std::size_t n = 0; n < data.mean.size(); ++n) {
    const double noise = 0.5 * data.noise[n] * data.noise[n];
    largest = std::max(
        largest, noise / (noise + kMisfit * Tolerance(data.mean[n], data.tail_weight)));
  }
  return largest;
}

// Linearized where `fit` and the rest found so far, if any, are. The error is that
// without the rest.
Whitened Whiten(const ReciprocalData& data,
                const ReciprocalFit& fit,
                const ReciprocalRest& rest,
                int threads) {
  Whitened result{std::vector<float>(data.pairs.value.size(), 0.0F),
                  std::vector<float>(data.pairs.value.size(), 0.0F)};
  ParallelFor(std::ssize(data.held), threads, [&](std::int64_t held) {
    const auto n = static_cast<std::size_t>(held);
    std::vector<float> s;
    std::vector<float> added;
    RowScratch scratch;
    for (std::size_t c = 0; c < data.channels; ++c) {
      const auto unit = static_cast<float>(1 / NoiseOf(data, c, data.held[n]));
      ReciprocalRows rows(
          data, fit, c, static_cast<std::size_t>(data.held[n]), scratch);
      s.resize(rows.Points());
      for (int y = rows.area().y0; y < rows.area().y1; ++y) {
        rows.Look(y);
        rows.Model(s.data());
        added.assign(s.size(), 0.0F);
        const auto first =
            static_cast<std::size_t>(std::int64_t{y} * data.width + rows.area().x0);
        for (Eigen::Index k = 0; k < rest.u.rows(); ++k) {
          const double v =
              rest.v(k, static_cast<Eigen::Index>(c * data.cells) + data.held[n]);
          AddScaled(added.data(),
                    &rest.u(k, static_cast<Eigen::Index>(first)),
                    static_cast<float>(v),
                    s.size());
        }
        const std::size_t at = data.HeldOffset(c, n) + first;
        for (std::size_t i = 0; i < s.size(); ++i) {
          const float model =
              std::exp(std::min(s[i] + added[i], static_cast<float>(kMostLog)));
          const float slope = model * unit * std::sqrt(data.pairs.weight[at + i]);
          const float change = std::clamp(
              data.pairs.value[at + i] / std::max(model, 1e-30F) - 1, -1.0F, 1.0F);
          result.slope[at + i] = slope;
          result.error[at + i] = slope * (change + added[i]);
        }
      }
    }
  });
  return result;
}

class RestFit {
 public:
  RestFit(const ReciprocalData& data, int threads)
      : known_noise_(KnownNoise(data)),
        plane_(static_cast<Eigen::Index>(data.Plane())),
        columns_(static_cast<Eigen::Index>(data.channels * data.held.size())),
        threads_(threads) {}

  void Linearize(Whitened white) { white_ = std::move(white); }

  // Terms to begin with, and what noise comes to.
  void Start(int terms) {
    const std::int64_t stride = std::max<std::int64_t>(1, plane_ / kSampled);
    RowMatrix y((plane_ + stride - 1) / stride, columns_);
    double measured = 0;
    Eigen::VectorXd slopes = Eigen::VectorXd::Zero(columns_);
    for (Eigen::Index column = 0; column < columns_; ++column) {
      for (Eigen::Index row = 0; row < y.rows(); ++row) {
        const std::size_t at = At(column) + static_cast<std::size_t>(row * stride);
        y(row, column) = static_cast<double>(white_.error[at]);
        const auto slope = static_cast<double>(white_.slope[at]);
        slopes(column) += slope * slope;
        measured += slope > 0 ? 1 : 0;
      }
    }
    v_.resize(0, columns_);
    if (!(y.cwiseAbs().maxCoeff() > 1e-12)) {
      return;
    }
    const TruncatedSvd svd = ComputeTruncatedSvd(y, terms, 1e-8);
    const double rows = measured / static_cast<double>(columns_);
    noise_ = std::max(
        {(y.squaredNorm() - svd.sigma.squaredNorm()) / measured, known_noise_, 1e-12});
    const double edge =
        noise_ * std::pow(std::sqrt(rows) + std::sqrt(double(columns_)), 2);
    Eigen::Index kept = 0;
    while (kept < svd.sigma.size() && std::pow(svd.sigma(kept), 2) > edge) {
      ++kept;
    }
    v_ = svd.sigma.head(kept).asDiagonal() * svd.basis.leftCols(kept).transpose();
    for (Eigen::Index column = 0; column < columns_; ++column) {
      v_.col(column) /= std::sqrt(rows * slopes(column) / double(y.rows())) + 1e-12;
    }
  }

  bool empty() const { return v_.rows() == 0; }
  const Eigen::MatrixXd& v() const { return v_; }
  const SharedMaps& u() const { return u_; }

  // The maps' posterior means given the kernels, and their mean products.
  void SolveMaps() {
    const Eigen::Index terms = v_.rows();
    u_ = SharedMaps::Zero(terms, plane_);
    products_ = SharedMaps::Zero(terms * (terms + 1) / 2, plane_);
    ParallelForBlocks(plane_, kBlock, threads_, [&](std::int64_t p0, std::int64_t p1) {
      SharedMaps pull = SharedMaps::Zero(terms, p1 - p0);
      SharedMaps blocks = SharedMaps::Zero(products_.rows(), p1 - p0);
      Collect(p0, p1, pull, blocks);
      for (Eigen::Index p = p0; p < p1; ++p) {
        SolvePoint(p, pull.col(p - p0), blocks.col(p - p0));
      }
    });
  }

  // Kernels, given what is known of the maps.
  void SolveKernels() {
    const Eigen::Index terms = v_.rows();
    ParallelFor(columns_, threads_, [&](std::int64_t column) {
      const Eigen::Map<const Eigen::VectorXf> slope(&white_.slope[At(column)], plane_);
      const Eigen::Map<const Eigen::VectorXf> error(&white_.error[At(column)], plane_);
      const Eigen::VectorXf weight = slope.cwiseAbs2();
      const Eigen::VectorXd sums = (products_ * weight).cast<double>();
      const Eigen::VectorXd right = (u_ * slope.cwiseProduct(error)).cast<double>();
      Eigen::MatrixXd normal = Unpacked(sums, terms);
      normal.diagonal() *= 1 + kKernelRidge;
      normal.diagonal().array() += kKernelPrior * noise_;
      v_.col(column) = normal.ldlt().solve(right);
    });
  }

 private:
  std::size_t At(Eigen::Index column) const {
    return static_cast<std::size_t>(column * plane_);
  }

  static Eigen::MatrixXd Unpacked(const Eigen::VectorXd& rows, Eigen::Index terms) {
    Eigen::MatrixXd matrix(terms, terms);
    Eigen::Index row = 0;
    for (Eigen::Index j = 0; j < terms; ++j) {
      for (Eigen::Index k = 0; k <= j; ++k) {
        matrix(j, k) = matrix(k, j) = rows(row++);
      }
    }
    return matrix;
  }

  // Normal equations of the points of a block.
  void Collect(std::int64_t p0,
               std::int64_t p1,
               SharedMaps& pull,
               SharedMaps& blocks) const {
    const auto n = static_cast<std::size_t>(p1 - p0);
    std::vector<float> weight(n);
    std::vector<float> product(n);
    for (Eigen::Index column = 0; column < columns_; ++column) {
      const float* slope = &white_.slope[At(column) + static_cast<std::size_t>(p0)];
      const float* error = &white_.error[At(column) + static_cast<std::size_t>(p0)];
      for (std::size_t i = 0; i < n; ++i) {
        weight[i] = slope[i] * slope[i];
        product[i] = slope[i] * error[i];
      }
      Eigen::Index row = 0;
      for (Eigen::Index j = 0; j < v_.rows(); ++j) {
        AddScaled(&pull(j, 0), product.data(), static_cast<float>(v_(j, column)), n);
        for (Eigen::Index k = 0; k <= j; ++k) {
          AddScaled(&blocks(row++, 0),
                    weight.data(),
                    static_cast<float>(v_(j, column) * v_(k, column)),
                    n);
        }
      }
    }
  }

  void SolvePoint(Eigen::Index p,
                  const Eigen::VectorXf& pull,
                  const Eigen::VectorXf& block) {
    const Eigen::Index terms = v_.rows();
    Eigen::MatrixXd normal = Unpacked(block.cast<double>(), terms);
    if (!(normal.trace() > 0)) {
      return;  // nothing is known here
    }
    normal.diagonal().array() += noise_ + 1e-9 * normal.trace();
    const Eigen::LLT<Eigen::MatrixXd> root(normal);
    const Eigen::VectorXd u = root.solve(pull.cast<double>());
    const Eigen::MatrixXd spread =
        noise_ * root.solve(Eigen::MatrixXd::Identity(terms, terms));
    Eigen::Index row = 0;
    for (Eigen::Index j = 0; j < terms; ++j) {
      u_(j, p) = static_cast<float>(u(j));
      for (Eigen::Index k = 0; k <= j; ++k) {
        products_(row++, p) = static_cast<float>(u(j) * u(k) + spread(j, k));
      }
    }
  }

  Whitened white_;
  double known_noise_;
  Eigen::Index plane_;
  Eigen::Index columns_;
  int threads_;
  double noise_ = 1;
  Eigen::MatrixXd v_;  // a column a channel and held offset
  SharedMaps u_;
  SharedMaps products_;  // of the maps, rows (j, k ≤ j)
};

}  // namespace

ReciprocalRest FitRest(const ReciprocalData& data,
                       const ReciprocalFit& fit,
                       int terms,
                       int thread_count) {
  ReciprocalRest result;
  RestFit rest(data, thread_count);
  for (int turn = 0; turn < kTurns; ++turn) {
    rest.Linearize({});  // frees what there is
    rest.Linearize(Whiten(data, fit, result, thread_count));
    if (turn == 0) {
      rest.Start(terms);
      if (rest.empty()) {
        return result;
      }
    }
    for (int round = 0; round < kRounds; ++round) {
      rest.SolveMaps();
      rest.SolveKernels();
    }
    rest.SolveMaps();
    result.u = rest.u();
    result.v = Eigen::MatrixXd::Zero(
        result.u.rows(), static_cast<Eigen::Index>(data.channels * data.cells));
    for (std::size_t c = 0; c < data.channels; ++c) {
      for (std::size_t n = 0; n < data.held.size(); ++n) {
        result.v.col(static_cast<Eigen::Index>(c * data.cells) + data.held[n]) =
            rest.v().col(static_cast<Eigen::Index>(c * data.held.size() + n));
      }
    }
  }
  return result;
}

}  // namespace nacre::factor::internal

#include "factor/internal/bilinear_fit.h"

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/bilinear_kernels.h"
#include "factor/internal/truncated_svd.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr int kMostRounds = 24;
constexpr double kLeastStep = 0.2;        // as a share of the whole
constexpr double kEnough = 0.001;         // a round that gains less is the last
constexpr std::int64_t kPairsATerm = 12;  // for each unknown of H, while iterating

// Normal equations of the f of one row of points, all offsets, in arrays over x: the
// upper triangle of the matrices, entry by entry, then the right sides.
class RowEquations {
 public:
  RowEquations(std::size_t terms, std::size_t width)
      : terms_(terms),
        width_(width),
        normal(terms * (terms + 1) / 2 * width, 0.0F),
        right(terms * width, 0.0F),
        seen_(terms * width),
        weighted_(width) {}

  // Points from x0 to x1 see points of the row `f` (first value: for x0) through
  // `kernel` (terms × terms, row-major: what enters f_j of x is its row j).
  struct Look {
    const float* const* f;
    const float* kernel;
    const std::uint8_t* count;
    const float* value;
    float weight;
    std::size_t x0;
    std::size_t points;
  };
  void Add(const Look& look);

 private:
  std::size_t terms_;
  std::size_t width_;

 public:
  std::vector<float> normal;
  std::vector<float> right;

 private:
  std::vector<float> seen_;
  std::vector<float> weighted_;
  std::vector<float> weights_;
  std::vector<float> targets_;
};

void RowEquations::Add(const Look& look) {
  const std::size_t n = look.points;
  weights_.resize(n);
  targets_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    weights_[i] = look.weight * static_cast<float>(look.count[i]);
    targets_[i] = weights_[i] * look.value[i];
  }
  std::fill_n(seen_.begin(), terms_ * n, 0.0F);
  for (std::size_t j = 0; j < terms_; ++j) {
    for (std::size_t k = 0; k < terms_; ++k) {
      AddScaled(&seen_[j * n], look.f[k], look.kernel[j * terms_ + k], n);
    }
  }
  std::size_t entry = 0;
  for (std::size_t j = 0; j < terms_; ++j) {
    const float* row = &seen_[j * n];
    AddProduct(&right[j * width_ + look.x0], row, targets_.data(), n);
    for (std::size_t i = 0; i < n; ++i) {
      weighted_[i] = weights_[i] * row[i];
    }
    for (std::size_t k = 0; k <= j; ++k) {
      AddProduct(
          &normal[entry++ * width_ + look.x0], weighted_.data(), &seen_[k * n], n);
    }
  }
}

// At d = 0 a point sees itself: f'Hf is quadratic, and f'(2Hf₀) ≈ value + f₀'Hf₀ near
// f₀. Doubles the kernel and returns these values for a row of points.
std::vector<float> LinearizeOwn(const BilinearFit& fit,
                                const Eigen::MatrixXd& h,
                                int first,
                                const float* values,
                                int width,
                                std::vector<float>& kernel) {
  std::vector<float> own(values, values + width);
  for (int x = 0; x < width; ++x) {
    const Eigen::VectorXd f = fit.f.col(first + x).cast<double>();
    own[static_cast<std::size_t>(x)] += static_cast<float>(f.dot(h * f));
  }
  for (float& entry : kernel) {
    entry *= 2;
  }
  return own;
}

// What one row of points sees of all others, both ways round.
RowEquations EquationsOfRow(const BilinearData& data, const BilinearFit& fit, int y) {
  const auto terms = static_cast<std::size_t>(fit.f.rows());
  RowEquations equations(terms, static_cast<std::size_t>(data.width));
  std::vector<float> kernel(terms * terms);
  std::vector<const float*> maps(terms);
  std::vector<float> own;
  const auto add = [&](std::size_t c, std::size_t cell, int du, int dv, bool is_first) {
    const PairArea area = data.OverlapOf(du, dv);
    if (y < area.y0 || y >= area.y1 || area.x1 <= area.x0) {
      return;
    }
    const Eigen::MatrixXd& h = fit.h[c * data.cells + cell];
    for (std::size_t j = 0; j < terms; ++j) {
      const int other = (y + dv) * data.width + area.x0 + du;
      maps[j] = &fit.f(static_cast<Eigen::Index>(j), other);
      for (std::size_t k = 0; k < terms; ++k) {
        const auto row = static_cast<Eigen::Index>(is_first ? j : k);
        const auto column = static_cast<Eigen::Index>(is_first ? k : j);
        kernel[j * terms + k] = static_cast<float>(h(row, column));
      }
    }
    const int first_x = is_first ? area.x0 : area.x0 + du;
    const int first_y = is_first ? y : y + dv;
    const std::size_t pair =
        data.Offset(c, cell) + static_cast<std::size_t>(first_y * data.width + first_x);
    const float* values = &data.values[pair];
    if (cell + 1 == data.cells) {
      own = LinearizeOwn(fit, h, y * data.width, values, data.width, kernel);
      values = own.data();
    }
    equations.Add({maps.data(),
                   kernel.data(),
                   &data.count[pair],
                   values,
                   static_cast<float>(data.weight[c * data.cells + cell]),
                   static_cast<std::size_t>(area.x0),
                   static_cast<std::size_t>(area.x1 - area.x0)});
  };
  for (std::size_t c = 0; c < data.channels; ++c) {
    for (std::size_t cell = 0; cell < data.cells; ++cell) {
      add(c, cell, data.OffsetX(cell), data.OffsetY(cell), true);
      if (cell + 1 < data.cells) {
        add(c, cell, -data.OffsetX(cell), -data.OffsetY(cell), false);
      }
    }
  }
  return equations;
}

// Least squares for all f at once, the others' being as they were. `variance` is that
// of a weighted measurement: points that little is known of stay near where they are.
SharedMaps SolveMaps(const BilinearData& data,
                     const BilinearFit& fit,
                     double variance,
                     const Workers& workers) {
  SharedMaps solved(fit.f.rows(), fit.f.cols());
  const Eigen::Index terms = fit.f.rows();
  const RankShare own = ShareOf(data.height, workers.ranks);
  ParallelFor(own.end - own.begin, workers.thread_count, [&](std::int64_t n) {
    const std::int64_t y = own.begin + n;
    const RowEquations equations = EquationsOfRow(data, fit, static_cast<int>(y));
    const auto width = static_cast<std::size_t>(data.width);
    Eigen::MatrixXd normal(terms, terms);
    Eigen::VectorXd right(terms);
    for (std::size_t x = 0; x < width; ++x) {
      std::size_t entry = 0;
      for (Eigen::Index j = 0; j < terms; ++j) {
        right(j) = static_cast<double>(
            equations.right[static_cast<std::size_t>(j) * width + x]);
        for (Eigen::Index k = 0; k <= j; ++k) {
          normal(j, k) = static_cast<double>(equations.normal[entry++ * width + x]);
        }
      }
      const double ridge =
          variance + kBilinearRidge * normal.trace() / static_cast<double>(terms) +
          1e-30;
      const auto at =
          static_cast<Eigen::Index>(static_cast<std::size_t>(y) * width + x);
      normal.diagonal().array() += ridge;
      right += ridge * fit.f.col(at).cast<double>();
      solved.col(at) =
          normal.selfadjointView<Eigen::Lower>().ldlt().solve(right).cast<float>();
    }
  });
  JoinPlanes(terms,
             data.height,
             workers.ranks,
             std::span(solved.data(), static_cast<std::size_t>(solved.size())));
  return solved;
}

// Of the maps' values over the grid.
Eigen::MatrixXd MeanProducts(const BilinearData& data, const SharedMaps& f) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(f.rows(), f.rows());
  for (int y = data.margin; y < data.height - data.margin; ++y) {
    const Eigen::MatrixXd row =
        f.middleCols(y * data.width + data.margin, data.width - 2 * data.margin)
            .cast<double>();
    sum.noalias() += row * row.transpose();
  }
  return sum / ((data.width - 2.0 * data.margin) * (data.height - 2.0 * data.margin));
}

// The same span of maps, with mean products that are the identity. A ridge keeps maps
// that depend on each other from blowing up.
void Whiten(const BilinearData& data, SharedMaps& f) {
  Eigen::MatrixXd products = MeanProducts(data, f);
  products.diagonal().array() += 1e-10 * products.trace() + 1e-30;
  const Eigen::MatrixXd root = products.llt().matrixL();
  f = root.triangularView<Eigen::Lower>().solve(f.cast<double>()).cast<float>();
}

// Turns the maps so that each contributes as much as possible after those before it.
void MakeCanonical(const BilinearData& data, BilinearFit& fit) {
  Eigen::MatrixXd energy = Eigen::MatrixXd::Zero(fit.f.rows(), fit.f.rows());
  for (std::size_t n = 0; n < fit.h.size(); ++n) {
    energy += data.weight[n] *
              (fit.h[n] * fit.h[n].transpose() + fit.h[n].transpose() * fit.h[n]);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(energy);
  const Eigen::MatrixXd turn = solver.eigenvectors().rowwise().reverse();
  Eigen::MatrixXd turned = (turn.transpose() * fit.f.cast<double>()).transpose();
  MakeSignsCanonical(turned);
  fit.f = turned.transpose().cast<float>();
}

double Measurements(const BilinearData& data) {
  double sum = 0;
  for (const std::uint8_t n : data.count) {
    sum += n;
  }
  return sum;
}

// Σ of weighted squares of all values.
double WeightedSquares(const BilinearData& data) {
  double all = 0;
  for (std::size_t n = 0; n < data.weight.size(); ++n) {
    double sum = 0;
    for (std::size_t p = n * data.Plane(); p < (n + 1) * data.Plane(); ++p) {
      const auto value = static_cast<double>(data.values[p]);
      sum += data.count[p] * value * value;
    }
    all += data.weight[n] * sum;
  }
  return all;
}

}  // namespace

BilinearFit FitBilinear(const BilinearData& data,
                        const SharedMaps& start,
                        const Workers& workers,
                        const ProgressFunction& progress) {
  BilinearFit fit{.f = start, .h = {}};
  Whiten(data, fit.f);
  const std::int64_t wanted =
      std::max<std::int64_t>(2048, kPairsATerm * start.rows() * start.rows());
  const int stride = static_cast<int>(
      std::max<std::int64_t>(1, static_cast<std::int64_t>(data.Plane()) / wanted));
  const double per_measurement =
      WeightedSquares(data) / std::max(Measurements(data), 1.0);
  SharedMaps best = fit.f;
  SharedMaps goal = fit.f;  // where the last step from `best` led
  double least = SolveAllKernels(data, stride, workers, fit);
  double gained = 1;
  double step = 1;
  while (fit.rounds < kMostRounds && step > kLeastStep && gained > kEnough) {
    Report(progress, {"factor", fit.rounds, kMostRounds, "alternating"});
    if (step == 1) {
      goal = SolveMaps(data, fit, least * least * per_measurement, workers);
    }
    fit.f = best + static_cast<float>(step) * (goal - best);
    Whiten(data, fit.f);
    const double residual = SolveAllKernels(data, stride, workers, fit);
    ++fit.rounds;
    if (residual < least) {
      gained = 1 - residual / least;
      least = residual;
      best = fit.f;
      step = 1;
    } else {
      step /= 2;
    }
  }
  fit.f = std::move(best);
  MakeCanonical(data, fit);
  fit.residual = SolveAllKernels(data, 1, workers, fit);
  return fit;
}

}  // namespace nacre::factor::internal

#include "factor/internal/bilinear_fit.h"

#include "core/parallel.h"
#include "core/rank_shares.h"
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
constexpr double kRidge = 1e-7;           // of the mean diagonal of normal equations
constexpr std::int64_t kPairsATerm = 12;  // for each unknown of H, while iterating

// Where x + d lies within the planes.
struct Overlap {
  int x0 = 0;
  int x1 = 0;
  int y0 = 0;
  int y1 = 0;
};

Overlap OverlapOf(const BilinearData& data, int du, int dv) {
  return {std::max(0, -du),
          data.width - std::max(0, du),
          std::max(0, -dv),
          data.height - std::max(0, dv)};
}

// Σ over a channel and offset of weighted squares: before and after the fit of H.
struct Squares {
  double all = 0;
  double left = 0;
};

// H of one offset, all channels. `stride` > 1 takes one in so many pairs.
void SolveKernels(const BilinearData& data,
                  std::size_t cell,
                  int stride,
                  BilinearFit& fit,
                  std::vector<Squares>& squares) {
  const Eigen::Index terms = fit.f.rows();
  const int du = data.OffsetX(cell);
  const int dv = data.OffsetY(cell);
  const Overlap area = OverlapOf(data, du, dv);
  std::vector<int> at;  // pairs that some channel has
  int n = static_cast<int>(cell) % stride;
  for (int y = area.y0; y < area.y1; ++y) {
    for (int x = area.x0; x < area.x1; ++x) {
      const int p = y * data.width + x;
      bool any = false;
      for (std::size_t c = 0; c < data.channels; ++c) {
        any = any || data.count[data.Offset(c, cell) + static_cast<std::size_t>(p)] > 0;
      }
      if (any && n++ % stride == 0) {
        at.push_back(p);
      }
    }
  }
  const int to = dv * data.width + du;
  const Eigen::Index pairs = std::ssize(at);
  Eigen::MatrixXd design(terms * terms, pairs);
  for (Eigen::Index k = 0; k < pairs; ++k) {
    const int p = at[static_cast<std::size_t>(k)];
    const Eigen::VectorXd f = fit.f.col(p).cast<double>();
    const Eigen::VectorXd g = fit.f.col(p + to).cast<double>();
    Eigen::Map<Eigen::MatrixXd>(&design(0, k), terms, terms).noalias() =
        f * g.transpose();
  }
  Eigen::LLT<Eigen::MatrixXd> normal;
  for (std::size_t c = 0; c < data.channels; ++c) {
    const std::size_t plane = data.Offset(c, cell);
    Eigen::VectorXd count(pairs);
    Eigen::VectorXd value(pairs);
    for (Eigen::Index k = 0; k < pairs; ++k) {
      const std::size_t p =
          plane + static_cast<std::size_t>(at[static_cast<std::size_t>(k)]);
      count(k) = data.count[p];
      value(k) = static_cast<double>(data.values[p]);
    }
    if (c == 0 || !data.same_count) {
      const Eigen::MatrixXd rooted = design * count.cwiseSqrt().asDiagonal();
      Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(terms * terms, terms * terms);
      matrix.selfadjointView<Eigen::Lower>().rankUpdate(rooted);
      const double ridge = kRidge * matrix.trace() / static_cast<double>(terms * terms);
      matrix.diagonal().array() += std::max(ridge, 1e-30);
      normal.compute(matrix);
    }
    const Eigen::VectorXd weighted = count.cwiseProduct(value);
    const Eigen::VectorXd solution = normal.solve(design * weighted);
    const Eigen::MatrixXd h =
        Eigen::Map<const Eigen::MatrixXd>(solution.data(), terms, terms);
    const bool middle = cell + 1 == data.cells;
    fit.h[c * data.cells + cell] =
        middle ? Eigen::MatrixXd(0.5 * (h + h.transpose())) : h;
    const double weight = data.weight[c * data.cells + cell];
    const Eigen::VectorXd residual = value - design.transpose() * solution;
    squares[c * data.cells + cell] = {weight * weighted.dot(value),
                                      weight * count.dot(residual.cwiseAbs2())};
  }
}

// Collective: the kernels and squares of which each rank has those of its cells.
void JoinKernels(const BilinearData& data,
                 const Ranks* ranks,
                 BilinearFit& fit,
                 std::vector<Squares>& squares) {
  const Eigen::Index terms = fit.f.rows();
  const auto size = static_cast<std::size_t>(terms * terms);
  std::vector<double> values(fit.h.size() * (size + 2), 0.0);  // [channel][cell]
  for (std::size_t n = 0; n < fit.h.size(); ++n) {
    double* to = &values[n * (size + 2)];
    std::copy_n(fit.h[n].data(), fit.h[n].size(), to);  // others' cells: none yet, or old
    to[size] = squares[n].all;
    to[size + 1] = squares[n].left;
  }
  JoinPlanes(static_cast<std::int64_t>(data.channels),
             static_cast<std::int64_t>(data.cells),
             ranks,
             std::span(values));
  for (std::size_t n = 0; n < fit.h.size(); ++n) {
    const double* from = &values[n * (size + 2)];
    fit.h[n] = Eigen::Map<const Eigen::MatrixXd>(from, terms, terms);
    squares[n] = {from[size], from[size + 1]};
  }
}

double SolveAllKernels(const BilinearData& data,
                       int stride,
                       const Workers& workers,
                       BilinearFit& fit) {
  fit.h.resize(data.channels * data.cells);
  std::vector<Squares> squares(fit.h.size());
  const RankShare own = ShareOf(static_cast<std::int64_t>(data.cells), workers.ranks);
  ParallelFor(own.end - own.begin, workers.thread_count, [&](std::int64_t n) {
    SolveKernels(data, static_cast<std::size_t>(own.begin + n), stride, fit, squares);
  });
  if (workers.ranks != nullptr) {
    JoinKernels(data, workers.ranks, fit, squares);
  }
  Squares sum;
  for (const Squares& s : squares) {
    sum.all += s.all;
    sum.left += s.left;
  }
  return sum.all > 0 ? std::sqrt(sum.left / sum.all) : 0;
}

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
    const Overlap area = OverlapOf(data, du, dv);
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
          variance + kRidge * normal.trace() / static_cast<double>(terms) + 1e-30;
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

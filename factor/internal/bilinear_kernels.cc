#include "factor/internal/bilinear_kernels.h"

#include "core/parallel.h"
#include "core/rank_shares.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

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
  const PairArea area = data.OverlapOf(du, dv);
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
      const double ridge =
          kBilinearRidge * matrix.trace() / static_cast<double>(terms * terms);
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
    std::copy_n(
        fit.h[n].data(), fit.h[n].size(), to);  // others' cells: none yet, or old
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

}  // namespace

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

}  // namespace nacre::factor::internal

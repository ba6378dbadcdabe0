#include "rigs/transport/diffusion/multigrid_solver.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::rigs::diffusion {
namespace {

constexpr int kCoarsestColumns = 4;  // a side
constexpr int kCoarsestSweeps = 4;   // pairs of symmetric ones

template <class Real>
std::vector<Real> Narrow(const std::vector<double>& values) {
  std::vector<Real> narrow(values.size());
  std::transform(values.begin(), values.end(), narrow.begin(), [](double v) {
    return static_cast<Real>(v);
  });
  return narrow;
}

}  // namespace

template <class Real>
internal::LevelView<Real> MultigridSolver<Real>::Level::View() const {
  return {static_cast<std::size_t>(nx),
          static_cast<std::size_t>(ny),
          static_cast<std::size_t>(nz),
          east.data(),
          north.data(),
          vertical.data(),
          layer.data(),
          inverse.data(),
          diagonal.data(),
          pivot.data()};
}

template <class Real>
typename MultigridSolver<Real>::Level MultigridSolver<Real>::MakeLevel(
    const SlabOperator& op) {
  Level level{.nx = op.nx,
              .ny = op.ny,
              .nz = op.nz,
              .east = Narrow<Real>(op.east),
              .north = Narrow<Real>(op.north),
              .vertical = Narrow<Real>(op.vertical),
              .layer = Narrow<Real>(op.layer_mm),
              .inverse = Narrow<Real>(op.inverse_mm),
              .diagonal = {},
              .pivot = {},
              .x = {},
              .b = {}};
  const auto nz = static_cast<std::size_t>(op.nz);
  level.diagonal.reserve(op.ColumnCount() * nz);
  level.pivot.reserve(op.ColumnCount() * nz);
  for (std::size_t c = 0; c < op.ColumnCount(); ++c) {
    double before = 0;  // the inverse pivot above
    for (std::size_t k = 0; k < nz; ++k) {
      const double diagonal = op.Diagonal(c, static_cast<int>(k));
      const double coupling = k == 0 ? 0 : op.vertical[c] * op.inverse_mm[k - 1];
      before = 1 / (diagonal - coupling * coupling * before);
      level.diagonal.push_back(static_cast<Real>(diagonal));
      level.pivot.push_back(static_cast<Real>(before));
    }
  }
  return level;
}

template <class Real>
MultigridSolver<Real>::MultigridSolver(const SlabOperator& op) {
  SlabOperator current = op;
  levels_.push_back(MakeLevel(current));
  while (std::max(current.nx, current.ny) > kCoarsestColumns) {
    current = Coarsen(current);
    levels_.push_back(MakeLevel(current));
    const std::size_t count =
        current.ColumnCount() * static_cast<std::size_t>(current.nz);
    levels_.back().x.resize(count);
    levels_.back().b.resize(count);
  }
  const std::size_t count = op.ColumnCount() * static_cast<std::size_t>(op.nz);
  for (auto* buffer : {&rhs_, &solution_, &direction_, &image_, &corrected_}) {
    buffer->resize(count);
  }
}

template <class Real>
std::size_t MultigridSolver<Real>::MemoryBytes() const {
  std::size_t bytes = 5 * rhs_.size() * sizeof(Block);
  for (const Level& level : levels_) {
    bytes += (level.x.size() + level.b.size()) * sizeof(Block) +
             (level.diagonal.size() + level.pivot.size()) * sizeof(Real);
  }
  return bytes;
}

// x = M b. The finest residual needs a buffer: A p's, which is done with by then.
template <class Real>
void MultigridSolver<Real>::Cycle(std::size_t depth, const Block* b, Block* x) {
  const internal::LevelView<Real> level = levels_[depth].View();
  internal::SolveColour(level, 0, true, b, x);
  internal::SolveColour(level, 1, false, b, x);
  if (depth + 1 == levels_.size()) {
    for (int sweep = 1; sweep < kCoarsestSweeps; ++sweep) {
      // 1 is solved for 0 already, and so on: the order is 0 1 | 0 1 … 0 and back.
      internal::SolveColour(level, 0, false, b, x);
      internal::SolveColour(level, 1, false, b, x);
    }
    internal::SolveColour(level, 0, false, b, x);
    return;
  }
  Level& next = levels_[depth + 1];
  // A coarser level's own b is free as soon as x is smoothed but for colour 0's last
  // solve, so residuals go to the buffer of the finest.
  Block* residual = image_.data();
  internal::ResidualOfColourZero(level, x, residual);
  internal::Restrict(level, next.View(), residual, next.b.data());
  Cycle(depth + 1, next.b.data(), next.x.data());
  internal::Prolong(level, next.View(), next.x.data(), x);
  internal::SolveColour(level, 1, false, b, x);
  internal::SolveColour(level, 0, false, b, x);
}

// [Hestenes52], each lane with numbers of its own. A lane that is done, or was zero
// from the start, gets steps of length 0.
template <class Real>
SolveSummary MultigridSolver<Real>::Solve(double tolerance, int most_iterations) {
  const internal::LevelView<Real> level = levels_.front().View();
  using Sums = internal::LaneSums<Real>;
  std::fill(solution_.begin(), solution_.end(), Block{});
  const Sums start = internal::Dot(level, rhs_.data(), rhs_.data());
  const auto ratio = [](double a, double b) { return b > 0 ? a / b : 0.0; };

  SolveSummary summary;
  Sums rz{};
  for (;;) {
    Cycle(0, rhs_.data(), corrected_.data());
    const Sums next = internal::Dot(level, rhs_.data(), corrected_.data());
    Block beta;
    for (std::size_t l = 0; l < kLanes; ++l) {
      beta.v[l] =
          static_cast<Real>(summary.iterations == 0 ? 0 : ratio(next[l], rz[l]));
    }
    rz = next;
    internal::Turn(level, beta, corrected_.data(), direction_.data());
    const Sums curvature = internal::Apply(level, direction_.data(), image_.data());
    Block step;
    for (std::size_t l = 0; l < kLanes; ++l) {
      step.v[l] = static_cast<Real>(ratio(rz[l], curvature[l]));
    }
    const Sums left = internal::Step(
        level, step, direction_.data(), image_.data(), solution_.data(), rhs_.data());
    ++summary.iterations;
    summary.residual = 0;
    for (std::size_t l = 0; l < kLanes; ++l) {
      summary.residual =
          std::max(summary.residual, std::sqrt(ratio(left[l], start[l])));
    }
    if (summary.residual <= tolerance) {
      return summary;
    }
    if (summary.iterations >= most_iterations || !std::isfinite(summary.residual)) {
      throw Error(
          fmt::format("solving the diffusion equation: the residual is {:.2g} after {} "
                      "iterations, {:.2g} was asked for; allow a larger one",
                      summary.residual,
                      summary.iterations,
                      tolerance));
    }
  }
}

template class MultigridSolver<float>;
template class MultigridSolver<double>;

}  // namespace nacre::rigs::diffusion

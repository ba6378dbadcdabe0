#pragma once

#include "rigs/transport/diffusion/internal/kernels.h"
#include "rigs/transport/diffusion/slab_operator.h"

#include <cstddef>
#include <vector>

namespace nacre::rigs::diffusion {

struct SolveSummary {
  int iterations = 0;
  /// The largest |b − A x| / |b| of the right-hand sides, as the iteration carries it.
  double residual = 0;
};

/// Conjugate gradients preconditioned by one symmetric multigrid cycle, for as many
/// right-hand sides at once as fit a 64-byte register: 16 floats or 8 doubles.
///
/// The cycle coarsens columns in x and y and keeps the layers, whose thickness may vary
/// at will: its smoother solves whole columns exactly, in red and black order (black
/// and red afterwards, which makes the cycle symmetric). Conductances are rediscretised
/// (Coarsen()); P is bilinear and the restriction its transpose.
///
/// Buffers are kept, so an object serves one thread. The result depends on the input
/// alone.
template <class Real>
class MultigridSolver {
 public:
  using Block = internal::Lanes<Real>;
  static constexpr std::size_t kLanes = Block::kCount;

  explicit MultigridSolver(const SlabOperator& op);

  /// The right-hand sides: unknown (column · nz + layer), to be filled by the caller;
  /// Solve() leaves the residual there.
  std::vector<Block>& rhs() { return rhs_; }
  const std::vector<Block>& solution() const { return solution_; }

  /// From a zero guess until the residual is below `tolerance` in every lane. Throws
  /// Error if that takes more than `most_iterations`.
  SolveSummary Solve(double tolerance, int most_iterations = 300);

  std::size_t MemoryBytes() const;

 private:
  struct Level {
    int nx, ny, nz;
    std::vector<Real> east, north, vertical, layer, inverse, diagonal, pivot;
    std::vector<Block> x, b;  // unused on the finest
    internal::LevelView<Real> View() const;
  };
  static Level MakeLevel(const SlabOperator& op);
  void Cycle(std::size_t depth, const Block* b, Block* x);

  std::vector<Level> levels_;
  std::vector<Block> rhs_, solution_, direction_, image_, corrected_;
};

extern template class MultigridSolver<float>;
extern template class MultigridSolver<double>;

}  // namespace nacre::rigs::diffusion

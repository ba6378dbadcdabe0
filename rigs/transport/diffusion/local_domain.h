#pragma once

#include "rigs/transport/diffusion/channel_setup.h"
#include "rigs/transport/diffusion/multigrid_solver.h"
#include "rigs/transport/diffusion/pattern_field.h"
#include "rigs/transport/transport.h"

#include <cstddef>
#include <vector>

namespace nacre::rigs::diffusion {

/// Columns of one size where beams and windows are, and where they lie in the sample
/// plane; a margin of growing columns is added around them.
struct DomainLayout {
  PointMm lower_left;
  double step_mm = 1;
  int count_x = 1;
  int count_y = 1;
};

/// A part of the slab cut out around a few beams, and the light of each beam in it.
template <class Real>
class LocalDomain {
 public:
  LocalDomain(const ChannelSetup& setup, const Mesh& mesh, const PatternFractions&);

  static constexpr std::size_t kLanes = MultigridSolver<Real>::kLanes;

  /// A pencil of `flux` through the column: a source where it first scatters, with the
  /// coefficients of `substance`, deposited exactly layer by layer.
  void AddBeam(std::size_t lane,
               std::size_t column,
               std::size_t substance,
               double flux);

  SolveSummary Solve(double tolerance);

  /// Mean over a column of what leaves the top, mm⁻²: see FromDepth().
  double Exitance(std::size_t lane, std::size_t column) const {
    const Real value = exitance_[column].v[lane];
    return static_cast<double>(value);
  }
  /// Fluxes out of the whole domain; they sum to 1 to the solver's tolerance.
  struct Budget {
    double top = 0;
    double bottom = 0;
    double sides = 0;  ///< and through a cut bottom: what truncation gets wrong
    double absorbed = 0;
  };
  Budget BudgetOf(std::size_t lane) const;

  /// Exitance is (1 − share) · the flux through the surface + share · what the adjoint
  /// of a beam collects, whose light is on its way out from one free path deep. In a
  /// homogeneous slab the two hardly differ; near borders they do, and Monte Carlo is
  /// in between (README.md).
  void FromDepth(double share) { from_depth_ = share; }
  std::size_t MemoryBytes() const { return solver_.MemoryBytes(); }

 private:
  double Deposit(std::size_t substance, std::size_t layer) const;

  const ChannelSetup& setup_;
  SlabOperator operator_;
  MultigridSolver<Real> solver_;
  std::vector<double> depth_edges_mm_;
  std::vector<float> second_fraction_;
  std::vector<internal::Lanes<Real>> exitance_;
  std::vector<Budget> straight_;  // light that never scatters
  double from_depth_ = 0;
};

extern template class LocalDomain<float>;
extern template class LocalDomain<double>;

/// The share that comes nearest to Monte Carlo on chessboards: 0.25 for η = 1, where
/// light leaves at all angles, 0.45 for η = 1.5, where it leaves from steep paths and
/// so from deeper. Found by measurement (README.md).
double ExitFromDepth(double eta);

/// Mesh of a layout with its margins; `*margin_columns` on each side.
Mesh MakeMesh(const ChannelSetup& setup,
              const DomainLayout& layout,
              int* margin_columns);

}  // namespace nacre::rigs::diffusion

#include "rigs/transport/diffusion/local_domain.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs::diffusion {
namespace {

// Coarse columns right beside a window would be felt in it: 1 % at its edge, where a
// border crosses them; with these 0.15 %.
constexpr int kGuardColumns = 3;

}  // namespace

double ExitFromDepth(double eta) {
  return std::clamp(0.25 + 0.4 * (eta - 1), 0.25, 0.75);
}

Mesh MakeMesh(const ChannelSetup& setup,
              const DomainLayout& layout,
              int* margin_columns) {
  const auto axis = [&](double low_mm, int count) {
    return GradedAxis({.low_mm = low_mm,
                       .step_mm = layout.step_mm,
                       .count = count,
                       .margin_mm = setup.margin_mm,
                       .guard = kGuardColumns,
                       .growth = 1.3},
                      margin_columns);
  };
  return {axis(layout.lower_left.x, layout.count_x),
          axis(layout.lower_left.y, layout.count_y),
          DepthAxis(setup.depth)};
}

template <class Real>
LocalDomain<Real>::LocalDomain(const ChannelSetup& setup,
                               const Mesh& mesh,
                               const PatternFractions& fractions)
    : setup_(setup),
      operator_(Assemble(mesh, MakeField(fractions, setup), setup.faces)),
      solver_(operator_),
      depth_edges_mm_(mesh.z.edges_mm),
      second_fraction_(fractions.column),
      straight_(kLanes) {
  std::fill(solver_.rhs().begin(), solver_.rhs().end(), internal::Lanes<Real>{});
}

// Of a unit flux, what scatters first in that layer.
template <class Real>
double LocalDomain<Real>::Deposit(std::size_t substance, std::size_t layer) const {
  const DiffusionMedium& medium = setup_.substances[substance].medium;
  const double above = medium.SigmaTPrime() * depth_edges_mm_[layer];
  const double below = medium.SigmaTPrime() * depth_edges_mm_[layer + 1];
  return medium.ReducedAlbedo() * -std::exp(-above) * std::expm1(above - below);
}

template <class Real>
void LocalDomain<Real>::AddBeam(std::size_t lane,
                                std::size_t column,
                                std::size_t substance,
                                double flux) {
  Expect(lane < kLanes && column < operator_.ColumnCount(), "a lane and a column");
  const DiffusionMedium& medium = setup_.substances[substance].medium;
  const auto nz = static_cast<std::size_t>(operator_.nz);
  for (std::size_t k = 0; k < nz; ++k) {
    solver_.rhs()[column * nz + k].v[lane] +=
        static_cast<Real>(flux * Deposit(substance, k));
  }
  const double through =
      flux * std::exp(-medium.SigmaTPrime() * depth_edges_mm_.back());
  Budget& straight = straight_[lane];
  straight.absorbed += (flux - through) * (1 - medium.ReducedAlbedo());
  if (setup_.bottom_diffuses) {
    solver_.rhs()[column * nz + nz - 1].v[lane] += static_cast<Real>(through);
  } else {
    (setup_.cut ? straight.sides : straight.bottom) += through;
  }
}

template <class Real>
SolveSummary LocalDomain<Real>::Solve(double tolerance) {
  const SolveSummary summary = solver_.Solve(tolerance);
  const auto nz = static_cast<std::size_t>(operator_.nz);
  const auto& phi = solver_.solution();
  exitance_.assign(operator_.ColumnCount(), {});
  for (std::size_t c = 0; c < operator_.ColumnCount(); ++c) {
    const double flux = operator_.top[c] / operator_.area_mm2[c];
    exitance_[c].v = static_cast<Real>((1 - from_depth_) * flux) * phi[c * nz].v;
    // Radiance along the normal is ∫ σ_s' φ / 4π exp(−σ_t' z) dz: a beam's own source
    // as weight. With φ ∝ z + z_b under the surface, 1 / (2A + 3) makes it the flux.
    const double f = static_cast<double>(second_fraction_[c]);
    for (std::size_t k = 0; k < nz; ++k) {
      const double weight =
          std::lerp(Deposit(0, k), Deposit(setup_.substances.size() - 1, k), f);
      exitance_[c].v +=
          static_cast<Real>(from_depth_ * weight / (2 * setup_.top_factor + 3)) *
          phi[c * nz + k].v;
    }
  }
  return summary;
}

template <class Real>
typename LocalDomain<Real>::Budget LocalDomain<Real>::BudgetOf(std::size_t lane) const {
  Budget budget = straight_[lane];
  const auto nz = static_cast<std::size_t>(operator_.nz);
  const auto& phi = solver_.solution();
  for (std::size_t c = 0; c < operator_.ColumnCount(); ++c) {
    const auto value = [&](std::size_t k) {
      return static_cast<double>(Real{phi[c * nz + k].v[lane]});
    };
    double weighted = 0;
    for (std::size_t k = 0; k < nz; ++k) {
      weighted += operator_.layer_mm[k] * value(k);
    }
    budget.top += operator_.top[c] * value(0);
    (setup_.cut ? budget.sides : budget.bottom) += operator_.bottom[c] * value(nz - 1);
    budget.sides += operator_.side[c] * weighted;
    budget.absorbed += operator_.absorption[c] * weighted;
  }
  if (setup_.bottom_absorbs) {
    budget.absorbed += budget.bottom;
    budget.bottom = 0;
  }
  return budget;
}

template class LocalDomain<float>;
template class LocalDomain<double>;

}  // namespace nacre::rigs::diffusion

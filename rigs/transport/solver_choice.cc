#include "rigs/transport/solver_choice.h"

#include "core/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fmt/format.h>
#include <limits>

namespace nacre::rigs {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

// What the errors were found to depend on, of one channel.
struct Traits {
  double albedo = 1;  // reduced, of the darkest medium
  double pitch = 0;   // of the grid, in the longest transport mean free path
  bool mixed = false;
  bool measured = true;  // within the range of the measurements
};

Traits TraitsOf(const Phantom& phantom, std::size_t channel) {
  constexpr double kLeastThickness = 4;  // free paths
  constexpr double kMostContrast = 2.5;  // of free paths
  double longest_mm = 0;
  double shortest_mm = kUnknown;
  Traits traits;
  // There may be media that the pattern doesn't use.
  const auto used = std::min(phantom.media.size(),
                             static_cast<std::size_t>(phantom.pattern.MediumCount()));
  for (std::size_t k = 0; k < used; ++k) {
    const Medium& medium = phantom.media[k];
    const double scattering = medium.ReducedScattering(channel);
    const double attenuation = scattering + medium.sigma_a_per_mm[channel];
    traits.measured =
        traits.measured && attenuation > 0 && std::abs(medium.g[channel]) <= 0.9;
    traits.albedo = std::min(traits.albedo, scattering / attenuation);
    longest_mm = std::max(longest_mm, 1 / attenuation);
    shortest_mm = std::min(shortest_mm, 1 / attenuation);
  }
  // Without a grid diffusion takes columns of 1.5 free paths.
  traits.pitch = phantom.grid.points_x > 0 ? phantom.grid.pitch_mm / longest_mm : 1.5;
  traits.mixed = used > 1;
  const Slab& slab = phantom.slab;
  traits.measured = traits.measured && longest_mm <= kMostContrast * shortest_mm &&
                    slab.thickness_mm >= kLeastThickness * longest_mm &&
                    slab.eta >= 1.3 && slab.eta <= 1.6 && slab.bottom == Bottom::kAir &&
                    phantom.layers.empty() && phantom.voxels == nullptr &&
                    phantom.beam.angle_rad == 0;
  return traits;
}

// Errors by reduced albedo: at least 0.99, 0.95, 0.8.
using ByAlbedo = std::array<double, 3>;

double Look(const ByAlbedo& errors, double albedo) {
  return albedo >= 0.99   ? errors[0]
         : albedo >= 0.95 ? errors[1]
         : albedo >= 0.8  ? errors[2]
                          : kUnknown;
}

// bench/rigs/monte_carlo_against_models, the worst of each class and a quarter more.
double FastError(const Traits& traits, Quantity quantity) {
  const bool fine = traits.pitch < 2;
  return Look(quantity == Quantity::kWindow
                  ? (fine ? ByAlbedo{0.40, 0.56, 0.95} : ByAlbedo{0.17, 0.26, 0.45})
              : traits.mixed ? ByAlbedo{0.19, 0.75, kUnknown}
                             : ByAlbedo{0.04, 0.17, 0.41},
              traits.albedo);
}

// Homogeneous windows are Monte Carlo's own profiles, to 1 % of noise.
double DiffusionError(const Traits& traits, Quantity quantity) {
  const bool fine = traits.pitch < 2;
  if (quantity == Quantity::kWindow) {
    return Look(!traits.mixed ? ByAlbedo{0.01, 0.01, 0.012}
                : fine        ? ByAlbedo{0.04, 0.12, kUnknown}
                              : ByAlbedo{0.035, 0.11, kUnknown},
                traits.albedo);
  }
  return Look(fine           ? ByAlbedo{0.23, 0.17, 0.16}
              : traits.mixed ? ByAlbedo{0.055, 0.17, kUnknown}
                             : ByAlbedo{0.045, 0.045, 0.06},
              traits.albedo);
}

}  // namespace

double StatedError(const Phantom& phantom, Solver solver, Quantity quantity) {
  if (solver == Solver::kMonteCarlo) {
    return 0;
  }
  constexpr double kFinestPitch = 0.5;
  double worst = 0;
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    const Traits traits = TraitsOf(phantom, c);
    const bool known = traits.measured && traits.pitch >= kFinestPitch * (1 - 1e-9);
    worst = std::max(worst,
                     !known                    ? kUnknown
                     : solver == Solver::kFast ? FastError(traits, quantity)
                                               : DiffusionError(traits, quantity));
  }
  return worst;
}

Selection SelectSolver(const Phantom& phantom,
                       const SolverOptions& options,
                       Quantity quantity,
                       const ProgressFunction& progress) {
  constexpr std::array kByCost = {Solver::kFast, Solver::kDiffusion};
  std::string refusals;
  for (const Solver solver : kByCost) {
    const bool known = solver == Solver::kFast || options.near_field;
    const double stated = known ? StatedError(phantom, solver, quantity) : kUnknown;
    if (options.error > 0 && !(stated <= options.error)) {
      refusals +=
          std::isinf(stated)
              ? fmt::format("of {} no error is known here; ", Name(solver))
              : fmt::format("{}'s stated error is {:.2g}; ", Name(solver), stated);
      continue;
    }
    try {
      Selection selection{
          solver, MakeTransport(phantom, solver, options, progress), stated, ""};
      selection.why =
          refusals +
          (options.error > 0
               ? fmt::format("{} is the cheapest whose stated error, {:.2g}, is at "
                             "most {:g}",
                             Name(solver),
                             stated,
                             options.error)
               : fmt::format("{} is the cheapest, and no --error is wanted",
                             Name(solver)));
      return selection;
    } catch (const Error& error) {
      // Not for this phantom; the next one may be. Stopping is not a refusal.
      if (error.code() == ExitCode::kInterrupted) {
        throw;
      }
      refusals += std::string(error.what()) + "; ";
    }
  }
  return {Solver::kMonteCarlo,
          MakeTransport(phantom, Solver::kMonteCarlo, options, progress),
          0,
          refusals + "mc has no error but its noise"};
}

}  // namespace nacre::rigs

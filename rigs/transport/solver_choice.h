#pragma once

#include "rigs/transport/transport.h"

#include <memory>
#include <string>

namespace nacre::rigs {

/// What an error is of.
enum class Quantity {
  kWindow,  ///< Σ |error| / Σ value over the cells of a window
  kTotals,  ///< of R and T, relative; relative to 0.01 where they are less
};

/// The error that a solver is known to stay below for such a phantom, in its worst
/// channel: from the measurements of bench/rigs/monte_carlo_against_models, not a
/// proof. Infinite where nothing is known. 0 for Monte Carlo, whose error is what one
/// waits for.
double StatedError(const Phantom& phantom, Solver solver, Quantity quantity);

struct Selection {
  Solver solver = Solver::kMonteCarlo;
  std::unique_ptr<Transport> transport;
  double stated_error = 0;
  std::string why;  ///< one line, for people
};

/// The cheapest solver that can do the phantom and whose stated error is at most
/// options.error; any error will do if that is 0. The order of costs is fast,
/// diffusion, mc. Throws what MakeTransport throws for Monte Carlo.
Selection SelectSolver(const Phantom& phantom,
                       const SolverOptions& options,
                       Quantity quantity,
                       const ProgressFunction& progress = {});

}  // namespace nacre::rigs

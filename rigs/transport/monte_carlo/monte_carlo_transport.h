#pragma once

#include "rigs/transport/monte_carlo/monte_carlo.h"
#include "rigs/transport/transport.h"

#include <mutex>
#include <vector>

namespace nacre::rigs::monte_carlo {

/// Monte Carlo as one of the solvers for phantoms. Every call simulates anew, with
/// random numbers of its own for each x_i and channel; equal calls give equal results.
class MonteCarloTransport final : public Transport {
 public:
  /// Throws as Validate does.
  MonteCarloTransport(const Phantom& phantom, const Options& options);

  const Phantom& phantom() const override { return phantom_; }

  /// sigma is the cells' standard error. Cells that the symmetry of phantom and beam
  /// makes equal share their photons.
  Window WindowAround(PointMm x_i) const override;

  /// Points get the mean over the grid's cell that they lie in, cells counted from x_i:
  /// a count has no value at a point. Throws BadData if the phantom has no grid.
  void AddExitance(PointMm x_i,
                   std::size_t channel,
                   double flux,
                   const PointColumns& points,
                   float* exitance) const override;

  /// To the noise of 400 000 photons, simulated at the first call.
  double ReachMm(std::size_t channel) const override;

  /// What a black backing takes counts as absorbed.
  Totals TotalsAt(PointMm x_i, std::size_t channel) const override;

  /// Everything there is to know of one beam, with standard errors.
  Result Simulate(PointMm x_i,
                  std::size_t channel,
                  const TallyRequest& request,
                  const ProgressFunction& progress = {}) const;

 private:
  double FindReachMm(std::size_t channel) const;

  Phantom phantom_;
  Options options_;
  std::vector<Volume> volumes_;  // one a channel
  mutable std::once_flag reach_found_;
  mutable std::vector<double> reach_mm_;
};

}  // namespace nacre::rigs::monte_carlo

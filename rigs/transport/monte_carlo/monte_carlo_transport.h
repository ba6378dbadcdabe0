#pragma once

#include "rigs/transport/monte_carlo/monte_carlo.h"
#include "rigs/transport/transport.h"

#include <mutex>
#include <vector>

namespace nacre::rigs::monte_carlo {

/// The error that `wanted_error` bounds, relative. Of a simulation with a window:
/// Σ |error| / Σ value over its cells, as expected from the standard errors se of
/// Gaussian noise, √(2/π) Σ se / Σ mean: the part of the light that is in a wrong cell.
/// Infinite as long as no light arrives in the window. Of one without: the larger of
/// the relative standard errors of R and T, relative to 0.01 where they are less.
double RelativeError(const Result& result);
double RelativeError(const Totals& totals);

/// What a black backing takes, and what leaves through the sides of a box, counts as
/// absorbed.
Totals ToTotals(const Result& result);

struct BeamOptions {
  double wanted_error = 0;  ///< 0: exactly Options::photon_count photons a beam
  bool diffuse = false;     ///< light from all directions instead of the beam's angle
};

/// Monte Carlo as one of the solvers for phantoms. Every call simulates anew, with
/// random numbers of its own for each x_i and channel; equal calls give equal results.
class MonteCarloTransport final : public Transport {
 public:
  /// With a wanted error a beam gets as many photons as that needs, at most
  /// options.photon_count; otherwise exactly that many. Throws as Validate does.
  MonteCarloTransport(const Phantom& phantom,
                      const Options& options,
                      const BeamOptions& beam_options = {},
                      const ProgressFunction& progress = {});

  const Phantom& phantom() const override { return phantom_; }

  /// sigma is the cells' standard error. Cells that the symmetry of phantom and beam
  /// makes equal share their photons.
  Window WindowAround(PointMm x_i) const override;

  /// The photons of each on all threads; of several ranks each takes every n-th point,
  /// and they share the photons of those that are left.
  void SolveWindows(std::span<const PointMm> points,
                    const std::function<void(std::size_t k, Window&& window)>& use,
                    const ProgressFunction& progress = {}) const override;

  /// Points get the mean over the grid's cell that they lie in, cells counted from x_i:
  /// a count has no value at a point. Throws BadData if the phantom has no grid.
  void AddExitance(PointMm x_i,
                   std::size_t channel,
                   double flux,
                   const PointColumns& points,
                   float* exitance) const override;

  /// To the noise of 400 000 photons, simulated at the first call.
  double ReachMm(std::size_t channel) const override;

  Totals TotalsAt(PointMm x_i, std::size_t channel) const override;

  /// The phantom's beam on x_i, as simulated.
  Source SourceAt(PointMm x_i) const;

  /// Everything there is to know of one beam, with standard errors.
  Result Simulate(PointMm x_i,
                  std::size_t channel,
                  const TallyRequest& request,
                  const ProgressFunction& progress = {}) const;

  /// The same of any light on one channel; source and request as they stand.
  Result SimulateLight(const Source& source,
                       std::size_t channel,
                       const TallyRequest& request,
                       const ProgressFunction& progress = {}) const;

 private:
  double FindReachMm(std::size_t channel) const;
  Result Run(Simulation& simulation, const ProgressFunction& progress) const;
  // A beam of one channel, and what is asked of it.
  struct Task {
    Source source;
    std::size_t channel;
    TallyRequest request;
  };
  Task TaskAt(PointMm x_i, std::size_t channel, const TallyRequest& request) const;
  // By those ranks together, or, without, by this process alone.
  Result Solve(const Task& task,
               const Ranks* ranks,
               const ProgressFunction& progress) const;
  Window WindowBy(PointMm x_i,
                  const Ranks* ranks,
                  const ProgressFunction& progress) const;

  Phantom phantom_;
  Options options_;
  BeamOptions beam_options_;
  ProgressFunction progress_;
  std::vector<Volume> volumes_;  // one a channel
  mutable std::once_flag reach_found_;
  mutable std::vector<double> reach_mm_;
};

}  // namespace nacre::rigs::monte_carlo

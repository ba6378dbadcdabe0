#pragma once

#include "core/options.h"
#include "core/progress.h"
#include "rigs/pattern.h"
#include "rigs/phantom.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::rigs {

/// R_d(x_i, ·) around one x_i: channel after channel, each core × core, row by row from
/// the top (+y), as a dataset stores it. Means over pitch × pitch cells centred on
/// x_i + d, mm⁻², per unit flux that entered.
struct Window {
  std::vector<float> rd;
  std::vector<float> sigma;  ///< standard deviation; 0 where the solver has no noise
};

/// Where the light that entered one channel ends up, as fractions of it, with standard
/// errors (0 of solvers without noise).
struct Totals {
  double reflected = 0;
  double transmitted = 0;
  double absorbed = 0;
  double reflected_se = 0;
  double transmitted_se = 0;
  double absorbed_se = 0;
  std::int64_t photons = 0;  ///< they are known from
};

/// A solver for one phantom. All of it is const and may be called from several threads,
/// unless work is shared among ranks: then every rank has to make the same calls in the
/// same order, from one thread.
class Transport {
 public:
  /// `thread_count`: of calls that say nothing else; 0: all cores. `ranks`: among whom
  /// the work is shared; null: nobody.
  explicit Transport(int thread_count = 0, const Ranks* ranks = nullptr)
      : thread_count_(thread_count), ranks_(ranks) {}
  virtual ~Transport() = default;
  virtual const Phantom& phantom() const = 0;

  /// The window of the phantom's grid for its beam centred on `x_i`.
  virtual Window WindowAround(PointMm x_i) const = 0;

  /// The windows of many x_i. `use(k, window)` is called for every k, one call at a
  /// time, in no particular order, and at the root alone; few windows are in memory at
  /// once. Throws Interrupted.
  virtual void SolveWindows(
      std::span<const PointMm> points,
      const std::function<void(std::size_t k, Window&& window)>& use,
      const ProgressFunction& progress = {}) const;

  /// Adds flux · R_d(x_i, x_o) to exitance[k] for every point x_o, for the phantom's
  /// beam centred on `x_i`: what a camera sees, with the flux's unit a mm².
  virtual void AddExitance(PointMm x_i,
                           std::size_t channel,
                           double flux,
                           const PointColumns& points,
                           float* exitance) const = 0;

  /// The distance beyond which less than 1e-4 of what entered leaves.
  virtual double ReachMm(std::size_t channel) const = 0;

  virtual Totals TotalsAt(PointMm x_i, std::size_t channel) const = 0;

 protected:
  /// For SolveWindows(): the windows of each unit, whose points have the given indices,
  /// by all threads and ranks.
  void SolveInUnits(const std::vector<std::vector<std::size_t>>& units,
                    const std::function<std::vector<Window>(std::size_t unit)>& solve,
                    const std::function<void(std::size_t k, Window&& window)>& use,
                    const ProgressFunction& progress) const;

  const Ranks* ranks() const { return ranks_; }

 private:
  int thread_count_;
  const Ranks* ranks_;
};

/// The solvers of this build, by the names that `nacre simulate --solver` takes.
enum class Solver {
  kAuto,        ///< the cheapest that meets the wanted error; see solver_choice.h
  kFast,        ///< PathAveraged
  kDiffusion,   ///< DiffusionTransport
  kMonteCarlo,  ///< MonteCarloTransport
};

/// "auto", "fast", "diffusion", "mc".
const char* Name(Solver solver);

/// Throws a usage Error that names the solvers there are.
Solver ParseSolver(const std::string& name);

struct SolverOptions {
  std::int64_t photons = 0;
  double error = 0;
  bool diffuse = false;
  bool near_field = true;
  std::int64_t seed = 1;
  int thread_count = 0;
  const Ranks* ranks = nullptr;  ///< see Transport

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("photons",
          self.photons,
          Range{0, 1e15},
          "mc: photons a beam and channel, at most if error is given; 0: a million, "
          "or as many as the error needs");
    visit("error",
          self.error,
          Range{0, 1},
          "relative error wanted, see rigs/transport/solver_choice.h; 0: any");
    visit("diffuse",
          self.diffuse,
          Range{},
          "mc: light arrives by Lambert's law, not at the beam's angle");
    visit(
        "near_field",
        self.near_field,
        Range{},
        "diffusion: Monte Carlo profiles of the media instead of diffusion's own near "
        "the beam");
    visit("seed", self.seed, Range{0}, "mc: the same seed gives the same result");
    visit("thread_count", self.thread_count, Range{0}, "0: all cores");
  }
};

/// kAuto chooses as SelectSolver() in solver_choice.h. `progress` is of the long
/// calls that take none themselves. Throws BadData if the phantom is outside what the
/// solver can do.
std::unique_ptr<Transport> MakeTransport(const Phantom& phantom,
                                         Solver solver,
                                         const SolverOptions& options,
                                         const ProgressFunction& progress = {});
std::unique_ptr<Transport> MakeTransport(const Phantom& phantom,
                                         Solver solver,
                                         int thread_count = 0);

}  // namespace nacre::rigs

#pragma once

#include "core/options.h"
#include "core/progress.h"
#include "rigs/transport/monte_carlo/source.h"
#include "rigs/transport/monte_carlo/volume.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::rigs::monte_carlo {

struct Options {
  std::int64_t photon_count = 1'000'000;
  std::int64_t seed = 1;
  int thread_count = 0;
  /// Among whom the photons are shared; null: nobody. All ranks make the same calls.
  const Ranks* ranks = nullptr;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("photon_count", self.photon_count, Range{1, 1e15}, "photons a channel");
    visit("seed", self.seed, Range{0}, "the same seed gives the same result");
    visit("thread_count", self.thread_count, Range{0}, "0: all cores");
  }
};

/// What to count beside the totals. A count of 0 leaves a table out.
struct TallyRequest {
  PointMm window_centre{};
  int window_core = 0;  ///< cells a side, row by row from the top (+y)
  double window_pitch_mm = 0;
  /// Averages the window over the mirrorings and turns that map volume and beam to
  /// themselves, if it is centred on the beam: up to eight times the photons a cell.
  bool use_symmetry = false;
  int ring_count = 0;  ///< rings around window_centre, at the top
  double ring_width_mm = 0;
  int cosine_count = 0;  ///< equal bins of the exit angle's cosine in air
  int depth_count = 0;   ///< bins of the depth of absorption
  double depth_step_mm = 0;
};

/// A mean over photons and its standard error.
struct Estimate {
  double mean = 0;
  double se = 0;
};

/// All per unit flux that entered; what the first surface reflects is `specular`, a
/// fraction of the arriving flux. Every photon ends in exactly one way, so
/// R + T + S + A + backing = 1 exactly.
struct Result {
  std::int64_t photon_count = 0;
  Estimate reflected;                ///< R: left through the top
  Estimate transmitted;              ///< T: left through the bottom
  Estimate sides;                    ///< S: left through the side faces of a box
  Estimate absorbed;                 ///< A: in the volume
  Estimate backing;                  ///< absorbed by a black backing
  Estimate unscattered_transmitted;  ///< the part of T
  std::vector<Estimate> absorbed_in_medium;
  double specular = 0;

  std::vector<Estimate> window_per_mm2;  ///< exitance at the top, means over cells
  std::vector<Estimate> ring_per_mm2;
  std::vector<Estimate> reflected_in_cosine;  ///< fractions; bin 0 is grazing
  std::vector<Estimate> transmitted_in_cosine;
  std::vector<Estimate> absorbed_in_depth;  ///< fractions

  std::int64_t step_count = 0;  ///< flights between tentative collisions or interfaces
  double cpu_seconds = 0;       ///< of all threads of this rank
};

/// Simulates photons one by one without any approximation but the rounding of single
/// precision (positions and directions; counts are integers). The result depends on
/// the seed and the photon count alone: not on the threads or ranks, nor on the
/// machine's instruction set. Throws BadData as Validate does, UsageError for bad
/// options, and Interrupted.
Result Simulate(const Volume& volume,
                const Source& source,
                const TallyRequest& request,
                const Options& options,
                const ProgressFunction& progress = {});

/// A simulation that photons are added to until they are enough. Photons are their own:
/// two additions give what one of their sum gives, bit for bit.
class Simulation {
 public:
  /// options.photon_count is ignored. Throws as Simulate does.
  Simulation(const Volume& volume,
             const Source& source,
             const TallyRequest& request,
             const Options& options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Throws Interrupted; the simulation is of no more use then.
  void Add(std::int64_t photon_count, const ProgressFunction& progress = {});
  /// Of all photons so far, at least one.
  Result Get() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The instruction sets this machine can run, best first, by Highway's names.
std::vector<std::string> InstructionSets();

/// Makes Simulate use the named one of InstructionSets(); empty: the best. For tests;
/// not while a simulation runs.
void UseInstructionSet(const std::string& name);

}  // namespace nacre::rigs::monte_carlo

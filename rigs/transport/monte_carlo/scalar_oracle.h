#pragma once

#include "rigs/transport/monte_carlo/monte_carlo.h"

namespace nacre::rigs::monte_carlo {

/// How the oracle deals with absorption.
enum class Capture {
  kAnalog,    ///< a photon is absorbed whole, at a collision
  kImplicit,  ///< its weight shrinks along its path; Russian roulette ends it
};

/// How the oracle deals with media that change on the way.
enum class Tracking {
  kExact,     ///< from face to face of cells and voxels
  kWoodcock,  ///< tentative collisions at the largest σ_t, some of them null
};

struct OracleMethod {
  Capture capture = Capture::kAnalog;
  Tracking tracking = Tracking::kExact;
  /// Below this weight a photon survives with probability 1/10, its weight tenfold.
  double roulette_weight = 1e-3;
};

/// Simulate, written to be read: one photon at a time, double precision, other random
/// numbers, one thread. Absorption by depth and medium is counted for kAnalog only.
Result SimulateScalar(const Volume& volume,
                      const Source& source,
                      const TallyRequest& request,
                      const Options& options,
                      const OracleMethod& method = {});

}  // namespace nacre::rigs::monte_carlo

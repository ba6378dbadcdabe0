#pragma once

#include "acquire/sample_stage.h"
#include "rigs/pattern.h"

#include <cstdint>
#include <vector>

namespace nacre::rigs {

/// One laser spot on the sample plane.
struct Spot {
  PointMm centre_mm;
  double cos_incidence = 1;
};

/// What the parts of a simulated rig share: the stage and the laser write it, the
/// camera sees it. Single-threaded, as a rig is.
struct World {
  acquire::Target target = acquire::Target::kNothing;
  int pose = 0;
  std::vector<Spot> spots;     ///< lit now; none if the laser is blanked
  int channel = 0;             ///< of those spots
  std::uint64_t revision = 0;  ///< grows with every change
};

}  // namespace nacre::rigs

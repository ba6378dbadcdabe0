#pragma once

#include "acquire/sample_stage.h"
#include "rigs/pattern.h"

#include <cstdint>
#include <vector>

namespace nacre::rigs {

/// One round laser spot.
struct Spot {
  PointMm centre_mm = {};     ///< on the sample plane
  double cos_incidence = 1;   ///< on the sample
  double power = 1;           ///< share of a beam's nominal power
  PointMm on_sample_mm = {};  ///< on the sample's surface, in its coordinates
  int beam = 0;               ///< a beam that isn't round is more than one spot
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

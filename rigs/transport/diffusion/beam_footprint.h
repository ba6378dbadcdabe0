#pragma once

#include "rigs/phantom.h"

#include <vector>

namespace nacre::rigs::diffusion {

/// A piece of a beam's cross section, small against its width.
struct BeamPoint {
  PointMm offset_mm;  ///< from the beam's centre
  double weight = 0;  ///< of its flux; 1 in sum
  int column_x = 0;   ///< the column it falls into, counted from the centre's
  int column_y = 0;
};

/// A pencil is four points close together: on a border it is shared by the media on
/// both sides, which keeps mirrored points mirrored.
std::vector<BeamPoint> BeamFootprint(const Beam& beam, double step_mm);

}  // namespace nacre::rigs::diffusion

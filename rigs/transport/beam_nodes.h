#pragma once

#include "rigs/phantom.h"

#include <vector>

namespace nacre::rigs {

/// A pencil that stands for a part of a beam.
struct BeamNode {
  PointMm offset_mm;
  double weight = 1;  ///< of the beam's flux
};

/// Quadrature over a beam's cross section; weights are 1 in sum. `feature_mm` is the
/// finest detail of what is to be integrated. A round beam is covered by half of it,
/// y > 0: enough for what has a mirror symmetry about the x axis.
std::vector<BeamNode> HalfRoundBeam(const Beam& beam, double feature_mm);
std::vector<BeamNode> SquareBeam(const Beam& beam, double feature_mm);

}  // namespace nacre::rigs

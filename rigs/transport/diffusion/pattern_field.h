#pragma once

#include "rigs/pattern.h"
#include "rigs/transport/diffusion/channel_setup.h"
#include "rigs/transport/diffusion/mesh.h"
#include "rigs/transport/diffusion/slab_operator.h"

#include <vector>

namespace nacre::rigs::diffusion {

/// How much of the second medium there is in a mesh's columns and between their
/// centres. Borders needn't follow the mesh.
struct PatternFractions {
  static constexpr int kLines = 8;  // across each column
  bool mixed = false;               ///< media are mixed, not side by side
  std::vector<float> column;        ///< nx · ny, by area
  std::vector<float> east;  ///< nx · ny · kLines, between centres, line by line
  std::vector<float> north;
};

/// The second medium's share of the way from a beam to each point. A beam on a border
/// is on both sides of it: the mean of four beams a thousandth of `step_mm` aside.
std::vector<float> SharesOfTheWay(const Pattern& pattern,
                                  PointMm beam,
                                  const PointColumns& points,
                                  double step_mm);

PatternFractions SampleFractions(const Pattern& pattern, const Mesh& mesh);

/// σ_a and the vertical D are means by area (of mixtures, 1 / D is). Between two
/// centres D is the harmonic mean along each of kLines parallel lines (layers in
/// series) and the mean of the lines (in parallel): of second order for borders along
/// the mesh, wherever they are.
LateralField MakeField(const PatternFractions& fractions, const ChannelSetup& setup);

}  // namespace nacre::rigs::diffusion

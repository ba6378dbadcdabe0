#pragma once

#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <vector>

namespace nacre::rigs::monte_carlo {

/// A mirroring or quarter turn about a point: (x, y) to (±x, ±y) or (±y, ±x).
struct Motion {
  bool exchange = false;  ///< of x and y, before the mirrorings
  bool mirror_x = false;
  bool mirror_y = false;
};

/// The motions about the beam's centre that map volume and beam to themselves, the
/// identity among them: all eight for a normal beam on layers, or on the middle of a
/// chessboard's square.
std::vector<Motion> Symmetries(const Volume& volume, const Source& source);

/// Replaces every cell of a window around the beam's centre by the mean over its
/// images. A photon ends in one of them at most, so that their sum is binomial as a
/// cell is, and the standard errors are exact: smaller by the root of the number of
/// images.
void AverageImages(const std::vector<Motion>& motions,
                   const TallyRequest& request,
                   Result& result);

}  // namespace nacre::rigs::monte_carlo

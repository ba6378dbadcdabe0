#pragma once

#include "core/random.h"
#include "rigs/phantom.h"

#include <string>

namespace nacre::rigs::testing {

/// A one-channel phantom of one medium.
inline Phantom Homogeneous(double sigma_a, double sigma_s, double thickness_mm) {
  Phantom phantom;
  phantom.channels = {"Y"};
  phantom.slab = {.thickness_mm = thickness_mm, .eta = 1.5, .bottom = Bottom::kAir};
  phantom.media = {{"only", {sigma_a}, {sigma_s}, {0.0}}};
  phantom.grid = {.points_x = 4, .points_y = 4, .pitch_mm = 2, .core = 9};
  return phantom;
}

/// One channel, marble and a dark partner.
inline Phantom TwoMarbles(PatternType type, double cell_mm) {
  Phantom phantom = Homogeneous(0.0021, 2.19, 10);
  phantom.media.push_back({"dark", {0.06}, {1.0}, {0.0}});
  phantom.pattern = {.type = type, .cell_mm = cell_mm};
  return phantom;
}

/// A point of a square of that width about the origin.
inline PointMm DrawPoint(RandomStream& random, double extent_mm) {
  const double x = (random.Uniform() - 0.5) * extent_mm;
  return {x, (random.Uniform() - 0.5) * extent_mm};
}

}  // namespace nacre::rigs::testing

#pragma once

#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <cmath>
#include <cstdint>

namespace nacre::rigs::monte_carlo {

inline Volume Slab(const Optics& optics, double thickness_mm, double eta) {
  Volume volume;
  volume.media = {optics};
  volume.layers = {{thickness_mm, eta, 0}};
  return volume;
}

/// The marble of Jensen 2001 (red) and a dark partner, 10 mm thick, cells of 1.5 mm.
inline Volume Chessboard() {
  Volume volume = Slab({0.0021, 2.19, 0}, 10, 1.5);
  volume.media.push_back({0.05, 1.0, 0});
  volume.pattern = {PatternType::kChessboard, 1.5};
  return volume;
}

inline Options Photons(std::int64_t count, std::int64_t seed = 1) {
  return {.photon_count = count, .seed = seed, .thread_count = 0};
}

/// Deviation from a number that is exact, or has a standard error of its own, in
/// standard errors.
inline double Deviation(const Estimate& estimate, double expected, double se = 0) {
  return (estimate.mean - expected) / std::hypot(estimate.se, se);
}

inline double Deviation(const Estimate& a, const Estimate& b) {
  return Deviation(a, b.mean, b.se);
}

}  // namespace nacre::rigs::monte_carlo

#pragma once

#include "render/integrators/path.h"
#include "render/seen_places.h"
#include "render/subsurface/subsurface.h"
#include "render/world.h"

#include <cstdint>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::render {

struct LitPointOptions {
  double points_per_patch = 4;          ///< a patch: PatchSizeMm() squared
  std::int64_t max_points = 2'000'000;  ///< an object
  std::uint64_t seed = 1;
  int thread_count = 0;
  const Ranks* ranks = nullptr;  ///< share the points' light; null: nobody does
  bool indirect = true;          ///< if the shape wants it too
  /// What the picture looks at; far from there, points are fewer. Null: all of it.
  const SeenPlaces* seen = nullptr;
};

struct LitPoints {
  std::vector<LitPoint> points;
  std::int64_t skipped = 0;  ///< points that would have been there without `seen`
  bool capped = false;       ///< max_points was too few for the patches asked for
  PathCounters counters;
  double area_mm2 = 0;
};

/// Divides the surface of a translucent shape into patches and finds the light that
/// enters each: direct light of all sources, and what a path tracer brings if the shape
/// and the integrator want it.
///
/// Clusters of patches are gathered as one when they are small for their distance, so
/// that at distance D of all that is seen the density may fall like D⁻², without the
/// points of a cluster becoming fewer: it falls by powers of 4, from 6 patches on, down
/// to 4⁻⁴.
LitPoints SampleLitPoints(const World& world,
                          std::uint32_t shape_index,
                          const PathTracer& tracer,
                          const LitPointOptions& options);

}  // namespace nacre::render

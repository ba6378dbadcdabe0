#pragma once

#include "render/integrators/path.h"

namespace nacre::render {

/// Of a path that is being traced.
struct PathTracer::State {
  Ray ray;
  Sampler& sampler;
  PathCounters& counters;
  int depth = 1;  ///< number of the edge that `ray` is
  int max_depth;
  Color radiance{};
  float alpha = 0;
  Color throughput{1, 1, 1};
  float eta_scale = 1;  ///< undoes the index of the medium in Russian roulette

  const ParticipatingMedium* medium = nullptr;  ///< around the ray; null: nothing

  // How the ray was chosen, for what it may find at its end.
  bool count_emission = true;
  bool from_camera = false;  ///< and nothing met so far
  bool delta = true;         ///< nothing else could have found it
  // Since the last surface that shows light of photons: whether the path left it by a
  // lobe that they are shown by, and has met one that carries them.
  bool from_shown = false;
  bool carried = false;
  Sight sight = Sight::kSharp;
  float pdf = 0;
  Vec3 origin{};
  Vec3 side{};
};

inline float PowerHeuristic(float pdf, float other) {
  const float a = pdf * pdf;
  return a / (a + other * other);
}

/// True if rays go through the surface as if it weren't there: all it does is part
/// media.
bool IsBoundaryOfMedia(const Shape& shape);

/// What is behind a surface that a ray crosses along `direction`, coming from `medium`.
const ParticipatingMedium* MediumBeyond(const SurfaceHit& hit,
                                        Vec3 direction,
                                        const ParticipatingMedium* medium);

inline bool IsBlack(Color c) {
  return c.x == 0 && c.y == 0 && c.z == 0;
}

}  // namespace nacre::render

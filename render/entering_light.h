#pragma once

#include "render/integrators/path.h"
#include "render/world.h"

#include <cstdint>

namespace nacre::render {

/// The light that enters a translucent surface at a point: Σ L cos θ F_t(η, θ_i) over
/// all sources and, if wanted, over what a path tracer brings.
class EnteringLight {
 public:
  /// The references must outlive it. `indirect`: by paths, too.
  EnteringLight(const World& world, const PathTracer& tracer, float eta, bool indirect)
      : world_(world), tracer_(tracer), eta_(eta), indirect_(indirect) {}

  /// Asks every light, with `samples` rays to each that has an extent.
  Color AllLights(const SurfaceHit& hit,
                  int samples,
                  std::uint64_t seed,
                  PathCounters& counters) const;

  /// Asks one light, chosen by its power, and follows one path: an estimate of the
  /// same.
  Color OneLight(const SurfaceHit& hit, Sampler& sampler, PathCounters& counters) const;

 private:
  Color Direct(const SurfaceHit& hit,
               const LightSample& sample,
               PathCounters& counters) const;
  Color Indirect(const SurfaceHit& hit, Sampler& sampler, PathCounters& counters) const;

  const World& world_;
  const PathTracer& tracer_;
  float eta_;
  bool indirect_;
};

}  // namespace nacre::render

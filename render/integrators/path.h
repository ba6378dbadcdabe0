#pragma once

#include "render/exitance_source.h"
#include "render/sampler.h"
#include "render/world.h"

#include <vector>

namespace nacre::render {

class PhotonMap;

/// A path tracer with light sampling, BSDF sampling and their combination by the power
/// heuristic [Veach97, section 9.2.4].
class PathTracer {
 public:
  /// All references must outlive it.
  PathTracer(const World& world,
             const ExitanceSources& exitances,
             const IntegratorSettings& settings);

  /// From now on, light that goes by way of glass or mirrors to a diffuse surface is
  /// taken from `photons` and nowhere else. Null: as before.
  void UsePhotons(const PhotonMap* photons) { photons_ = photons; }

  struct Result {
    Color radiance;
    float alpha = 0;  ///< 1 if the ray hit anything
  };

  /// Along a camera ray.
  Result Radiance(const Ray& ray, Sampler& sampler, PathCounters& counters) const;

  /// Along a ray that left a translucent surface whose direct light is known already:
  /// what emits is left out at its end. The ray is the second edge of its path.
  Color IndirectRadiance(const Ray& ray,
                         Sampler& sampler,
                         PathCounters& counters) const;

 private:
  struct State;
  bool CountsEmission(const State& state) const;
  void AddPhotons(State& state,
                  const SurfaceHit& hit,
                  const Frame& frame,
                  Vec3 wo) const;
  void Trace(State& state) const;
  void AddDirectLight(State& state,
                      const SurfaceHit& hit,
                      const Frame& frame,
                      Vec3 wo) const;
  bool Continue(State& state, const SurfaceHit& hit, const Frame& frame, Vec3 wo) const;
  bool Survives(State& state) const;
  // Of the light sampled, what gets to a hit that isn't black for it.
  Color LightArriving(State& state,
                      const SurfaceHit& hit,
                      const LightSample& light) const;

  // What becomes of a ray in a medium before it gets to the next surface;
  // path_media.cc.
  enum class MediumEvent { kPassed, kScattered, kEnded };
  MediumEvent CrossMedium(State& state, float distance) const;
  void AddLightInMedium(State& state, Vec3 position) const;
  Color LightThroughMedia(State& state,
                          const ParticipatingMedium* medium,
                          Ray ray) const;
  Color TranslucentRadiance(State& state, const SurfaceHit& hit, Vec3 to_viewer) const;

  const World& world_;
  const ExitanceSources& exitances_;
  const PhotonMap* photons_ = nullptr;
  IntegratorSettings settings_;
  bool has_media_ = false;
  std::vector<float> exit_scale_;  ///< 1 / (π c(η)) a shape
};

}  // namespace nacre::render

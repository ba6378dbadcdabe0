#pragma once

#include "render/embree_scene.h"
#include "render/sampler.h"
#include "render/scene.h"

#include <memory>
#include <optional>
#include <vector>

namespace nacre::render {

/// Light arriving at a point from a light chosen at random.
struct LightSample {
  Vec3 wi;             ///< unit, to the light
  float distance = 0;  ///< infinite for distant lights
  Color radiance;      ///< over `pdf`: the estimate of L, or of intensity / distance²
  float pdf = 0;       ///< a steradian; 0: no light from here
  bool delta = false;  ///< nothing but light sampling can find it
  float margin = 0;    ///< error of a surface's place, in scene units
};

/// From a hit to a light, ending short of it: of the light's own surface, although both
/// ends are moved or rounded.
Ray ShadowRay(const SurfaceHit& hit, const LightSample& light);

/// A scene made ready for questions: what does a ray hit, where does light come from.
/// Immutable, asked from many threads.
class World {
 public:
  /// `scene` must outlive it.
  World(const Scene& scene, int thread_count);

  const Scene& scene() const { return scene_; }
  const EmbreeScene& geometry() const { return geometry_; }

  /// One light chosen by its power. `side`: the normal on the side that is lit, or 0 if
  /// light counts from everywhere.
  LightSample SampleLight(Vec3 position, Vec3 side, float u_light, Vec2 u) const;
  /// The same of a given light, in [0, light_count()).
  LightSample SampleLight(std::size_t light, Vec3 position, Vec3 side, Vec2 u) const;
  std::size_t light_count() const { return sources_.size(); }
  /// True for points and directions, which need one sample only.
  bool IsDeltaLight(std::size_t light) const;

  /// Radiance of the surface hit, to where the ray came from.
  Color Emission(const SurfaceHit& hit, Vec3 to_viewer) const;
  /// The density a steradian with which SampleLight would have chosen the direction to
  /// this hit of an emitting shape, seen from `position`.
  float EmissionPdf(const SurfaceHit& hit, Vec3 position) const;
  /// Radiance from where nothing is, and its density.
  Color Background(Vec3 direction) const;
  float BackgroundPdf(Vec3 side, Vec3 wi) const;

 private:
  struct Source {
    const Light* light = nullptr;        ///< or
    std::optional<AreaSampler> emitter;  ///< an emitting shape
    std::uint32_t shape_index = 0;
    float probability = 0;
    float cumulative = 0;
  };

  LightSample SampleEmitter(const Source& source, Vec3 position, Vec2 u) const;
  void AddSource(Source source, Color power, float weight);

  const Scene& scene_;
  EmbreeScene geometry_;
  std::vector<Source> sources_;
  std::vector<int> source_of_shape_;      ///< −1: doesn't emit
  std::vector<std::size_t> backgrounds_;  ///< sources that are everywhere
};

}  // namespace nacre::render

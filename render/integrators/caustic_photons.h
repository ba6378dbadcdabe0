#pragma once

#include "render/integrators/photon_map.h"
#include "render/world.h"

#include <cstdint>
#include <memory>

namespace nacre::render {

/// Whether light that passes this shape on its way to a diffuse surface is brought by
/// photons: mirrors and clear glass, unless instanced.
bool CarriesPhotons(const Shape& shape);

/// Light that is bent or mirrored, once or more, before it meets a surface that shows
/// it, traced from the lights [Jensen96]. Progressive [Hachisuka09], in the form in
/// which each picture has a map of its own and the radius shrinks from map to map, so
/// that noise and bias of their mean both vanish [Knaus11].
class CausticPhotons {
 public:
  /// The world must outlive it.
  CausticPhotons(const World& world, const PhotonSettings& settings, int max_depth);

  /// Map `index` = 0, 1, …, a function of seed and index alone.
  PhotonMap Map(std::int64_t index, std::uint64_t seed, int thread_count) const;

  /// Of map `index`, in scene units.
  float Radius(std::int64_t index) const;

 private:
  struct Target {
    AreaSampler area;
    double cumulative;  ///< area up to and with this shape
  };
  void Trace(std::uint64_t seed, std::int64_t number, std::vector<Photon>& found) const;
  void Follow(Photon photon,
              SurfaceHit hit,
              Sampler& sampler,
              std::vector<Photon>& found) const;

  const World& world_;
  PhotonSettings settings_;
  int max_depth_;
  std::vector<Target> targets_;
};

}  // namespace nacre::render

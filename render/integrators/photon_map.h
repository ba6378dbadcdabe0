#pragma once

#include "render/bsdf/bsdf.h"
#include "render/embree_scene.h"

#include <cstdint>
#include <vector>

namespace nacre::render {

/// Light that arrived at a surface which shows it.
struct Photon {
  Vec3 position;
  Vec3 wi;                 ///< unit, to where it came from
  Vec3 normal;             ///< of the surface, unit
  Color flux_w;            ///< in units of the scene's lengths
  std::int32_t edges = 0;  ///< of its path, from the light to here
};

/// Photons in a grid, for what arrives within one radius [Jensen96].
class PhotonMap {
 public:
  PhotonMap() = default;
  PhotonMap(std::vector<Photon> photons, float radius);

  /// Reflected radiance, estimated from the photons within the radius of a hit: of
  /// those of at most `max_edges` (−1: any number).
  Color Radiance(const SurfaceHit& hit,
                 const Frame& frame,
                 Vec3 wo,
                 int max_edges) const;

  std::size_t size() const { return photons_.size(); }

 private:
  struct Cell {
    std::int32_t x;
    std::int32_t y;
    std::int32_t z;
    friend bool operator==(const Cell&, const Cell&) = default;
  };
  Cell CellOf(Vec3 position) const;
  std::size_t Bucket(const Cell& cell) const;

  float radius_ = 0;
  float per_cell_ = 0;
  std::size_t mask_ = 0;
  std::vector<Photon> photons_;       ///< by bucket
  std::vector<std::uint32_t> begin_;  ///< of a bucket; and the end
};

}  // namespace nacre::render

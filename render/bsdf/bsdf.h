#pragma once

#include "render/vec.h"

namespace nacre::render {

struct BsdfValue {
  Color value;    ///< f(ω_o, ω_i) |cos θ_i|
  float pdf = 0;  ///< of Sample choosing ω_i, a steradian; delta lobes left out
};

struct BsdfSample {
  Vec3 wi;
  Color weight;   ///< f |cos θ_i| / pdf, for the whole choice of lobe and direction
  float pdf = 0;  ///< a steradian; 0: no direction, the path ends
  bool delta = false;  ///< mirror or refraction; pdf is then a probability
  float eta = 1;       ///< index on ω_i's side / on ω_o's; 1 unless refracted
};

/// How a surface scatters. Directions are unit, point away from the surface and are in
/// its local frame: +z the outward shading normal. ω_o goes to the viewer, ω_i to the
/// light. All directions are legal, also below the surface.
class Bsdf {
 public:
  virtual ~Bsdf() = default;

  /// Delta lobes count as 0.
  virtual BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const = 0;
  virtual BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2 u) const = 0;
  /// True if Evaluate is 0 everywhere, so that sampling lights is useless.
  virtual bool IsDelta() const { return false; }
  /// True if Evaluate isn't 0 for directions on different sides.
  virtual bool Transmits() const { return false; }
};

}  // namespace nacre::render

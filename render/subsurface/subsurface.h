#pragma once

#include "render/vec.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace nacre::render {

/// A point of a translucent surface, with what any model of R_d may want to know of it.
/// Lengths are in millimetres of the material (scene units times the object's scale).
struct SurfacePoint {
  Vec3 position_mm;
  Vec3 normal;     ///< unit, outward
  Vec3 tangent_u;  ///< unit ∂p/∂u, orthogonal to the normal
  Vec3 tangent_v;  ///< unit, orthogonal to the normal, on the side of ∂p/∂v (may be
                   ///< mirrored)
  Vec2 uv;         ///< (0, 0) lower left of the sample, (1, 1) upper right; repeats
};

/// A patch of the surface that was lit: light entered here.
struct LitPoint {
  SurfacePoint point;
  float area_mm2 = 0;
  Color flux_density;  ///< transmitted through the surface, W mm⁻²
};

/// Carries light from where it enters to where it leaves: M(x_o) = Σ_i R_d(x_i, x_o)
/// Φ_i. Built once over the lit points of one object, then asked from many threads.
class Subsurface {
 public:
  virtual ~Subsurface() = default;

  /// Radiant exitance (before the factor F_t(η, ω_o) / (π c(η)) that gives radiance).
  virtual Color Exitance(const SurfacePoint& x_o) const = 0;
};

/// A material, before it has seen any light.
class SubsurfaceModel {
 public:
  virtual ~SubsurfaceModel() = default;

  /// Refractive index of the inside relative to the outside.
  virtual float Eta() const = 0;

  /// The side of the patches into which the surface should be divided so that the
  /// gathered exitance is good to about 1 %: a fraction of the mean free path or of the
  /// pitch.
  virtual float PatchSizeMm() const = 0;

  /// The model with its light. `lit` may be reordered and kept.
  virtual std::unique_ptr<Subsurface> Illuminate(std::vector<LitPoint> lit,
                                                 int thread_count) const = 0;
};

}  // namespace nacre::render

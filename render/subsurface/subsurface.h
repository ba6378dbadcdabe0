#pragma once

#include "render/subsurface/radial_density.h"
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
  /// Of uv on the surface: ∂p/∂u = x tangent_u, ∂p/∂v = y tangent_u + z tangent_v. 0 if
  /// not known.
  Vec3 stretch_mm{};
};

/// The tangents of a point with a normal, from sums along u and v of any length.
/// Without usable ones, some frame.
void SetTangents(SurfacePoint& point, Vec3 along_u, Vec3 along_v);

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
  /// Adds to `pairs` the number of sources, patches or clusters, that were asked.
  virtual Color Gather(const SurfacePoint& x_o, std::int64_t& pairs) const = 0;

  Color Exitance(const SurfacePoint& x_o) const {
    std::int64_t pairs = 0;
    return Gather(x_o, pairs);
  }
};

/// What of a material has been used since it was made.
struct ModelUse {
  std::int64_t windows = 0;        ///< evaluated; 0 for models without
  std::int64_t windows_total = 0;  ///< that there are
  std::int64_t tiles = 0;          ///< read from file; 0 for what is in memory
  std::int64_t tiles_total = 0;
  int channels = 3;     ///< read
  int terms = 0;        ///< of these channels, that count; 0 for models without
  int terms_total = 0;  ///< of all channels
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

  /// The distance between places from which the exitance may be interpolated.
  virtual float ExitanceSpacingMm() const { return 2 * PatchSizeMm(); }

  /// R_d(x_i, x_o) itself, in mm⁻²: what `Illuminate` gathers, without patches.
  virtual Color Rd(const SurfacePoint& x_i, const SurfacePoint& x_o) const = 0;

  /// Distances in the plane, distributed about as light spreads.
  virtual RadialDensity Spread() const = 0;

  virtual ModelUse Use() const { return {}; }

  /// The model with its light. `lit` may be reordered and kept.
  virtual std::unique_ptr<Subsurface> Illuminate(std::vector<LitPoint> lit,
                                                 int thread_count) const = 0;
};

}  // namespace nacre::render

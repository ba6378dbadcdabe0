#pragma once

#include "render/vec.h"

namespace nacre::render {

/// An isotropic rough interface of microscopic facets with Smith's shadowing, heights
/// of masking and shadowing correlated [Heitz14]. Directions are in the local frame.
struct Microfacet {
  enum class Kind {
    kGgx,       ///< [Walter07]
    kBeckmann,  ///< [Beckmann & Spizzichino 63]
  };
  Kind kind = Kind::kGgx;
  float alpha = 0.1F;

  /// Density of facet normals: ∫ D(m) cos θ_m dm = 1.
  float D(Vec3 m) const;
  /// Smith's Λ of a direction with cosine `cos_theta` > 0.
  float Lambda(float cos_theta) const;
  float G1(float cos_theta) const { return 1 / (1 + Lambda(cos_theta)); }
  float G2(float cos_o, float cos_i) const {
    return 1 / (1 + Lambda(cos_o) + Lambda(cos_i));
  }

  /// A facet normal and its density a steradian. For GGX of the facets visible from wo
  /// (wo.z > 0) [Dupuy & Benyoub 23], for Beckmann of all facets.
  Vec3 SampleNormal(Vec3 wo, Vec2 u) const;
  float NormalPdf(Vec3 wo, Vec3 m) const;
};

}  // namespace nacre::render

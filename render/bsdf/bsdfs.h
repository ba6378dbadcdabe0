#pragma once

#include "render/bsdf/bsdf.h"
#include "render/bsdf/microfacet.h"
#include "render/texture.h"

#include <memory>

namespace nacre::render {

using BsdfPtr = std::shared_ptr<const Bsdf>;

/// Lambert's.
BsdfPtr MakeDiffuse(TexturePtr reflectance);

/// Clear coat on a diffuse base. Light that enters is reflected at the base and at the
/// coat's inside until it leaves.
struct PlasticParameters {
  TexturePtr diffuse_reflectance;
  TexturePtr specular_reflectance;  ///< 1: physical
  float eta = 1.49F;                ///< inside / outside
  /// True: the base tints every bounce below the coat; false: only the first, which
  /// keeps the texture's hue (Mitsuba's `nonlinear`).
  bool nonlinear = false;
};
BsdfPtr MakePlastic(const PlasticParameters& parameters);
BsdfPtr MakeRoughPlastic(const PlasticParameters& parameters, const Microfacet& facets);

struct ConductorParameters {
  Color eta{};  ///< of the metal relative to the outside
  Color k{};
  TexturePtr specular_reflectance;  ///< 1: physical
  bool perfect = false;             ///< reflects everything, eta and k ignored
};
BsdfPtr MakeConductor(const ConductorParameters& parameters);
/// With the energy that a single bounce between facets loses put back
/// [Kulla & Conty 17].
BsdfPtr MakeRoughConductor(const ConductorParameters& parameters,
                           const Microfacet& facets);

struct DielectricParameters {
  float eta = 1.5046F;  ///< inside / outside
  TexturePtr specular_reflectance;
  TexturePtr specular_transmittance;
};
/// A smooth interface that light crosses.
BsdfPtr MakeDielectric(const DielectricParameters& parameters);

/// The same with facets, and with the energy that single bounces between them lose put
/// back on both sides, after [Kulla & Conty 17].
BsdfPtr MakeRoughDielectric(const DielectricParameters& parameters,
                            const Microfacet& facets);

/// What a translucent surface is where light doesn't spread in it: it leaves where it
/// entered, f = A F_t(θ_i) F_t(θ_o) / (π c(η)); under what `coat` reflects (null:
/// nothing). Where A is 0, the coat alone.
BsdfPtr MakeLocalTranslucency(BsdfPtr coat, TexturePtr albedo, float eta);

/// The front of `front` on both sides.
BsdfPtr MakeTwoSided(BsdfPtr front);

}  // namespace nacre::render

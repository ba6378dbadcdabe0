#pragma once

#include "render/bsdf/microfacet.h"

#include <functional>
#include <vector>

namespace nacre::render {

/// Directional albedo E(μ_o) = ∫ f |cos θ_i| dω_i of a lobe of a rough interface, by
/// quadrature when the material is made and by interpolation afterwards.
class AlbedoTable {
 public:
  /// Of what `facets` reflect; `reflectance(cos)` is Fresnel's. What it misses of 1
  /// went inside, or is lost by the single bounce of the model.
  AlbedoTable(const Microfacet& facets, const std::function<float(float)>& reflectance);

  /// `weight(wo, u)` is f |cos θ_i| / pdf of a direction drawn by u.
  explicit AlbedoTable(const std::function<float(Vec3 wo, Vec2 u)>& weight);

  float operator()(float cos_o) const;
  /// ∫₀¹ 2 E(μ) μ dμ.
  float Mean() const { return mean_; }

 private:
  std::vector<float> values_;
  float mean_ = 0;
};

}  // namespace nacre::render

#pragma once

#include "render/bsdf/microfacet.h"

#include <functional>
#include <vector>

namespace nacre::render {

/// Directional albedo E(μ_o) = ∫ f |cos θ_i| dω_i of the reflecting lobe of a rough
/// interface, by quadrature when the material is made and by interpolation afterwards.
/// What it misses of 1 went inside, or is lost by the single bounce of the model.
class AlbedoTable {
 public:
  /// `reflectance(cos)` is Fresnel's, of the facets.
  AlbedoTable(const Microfacet& facets, const std::function<float(float)>& reflectance);

  float operator()(float cos_o) const;
  /// ∫₀¹ 2 E(μ) μ dμ.
  float Mean() const { return mean_; }

 private:
  std::vector<float> values_;
  float mean_ = 0;
};

}  // namespace nacre::render

#pragma once

#include "render/vec.h"

#include <cmath>

namespace nacre::render {

/// core/fresnel.h in single precision and inline, for inner loops: unpolarised
/// reflectance of a smooth dielectric, cos_i in [0, 1] on the light's side, `eta` =
/// n_other_side / n_this_side.
inline float FresnelDielectric(float cos_i, float eta) {
  const float sin2_t = (1 - cos_i * cos_i) / (eta * eta);
  if (sin2_t >= 1) {
    return 1;
  }
  const float cos_t = std::sqrt(1 - sin2_t);
  const float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  const float perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  return 0.5F * (parallel * parallel + perpendicular * perpendicular);
}

/// Unpolarised reflectance of a conductor with index eta + i k relative to the outside
/// [Born & Wolf, section 14.2].
inline float FresnelConductor(float cos_i, float eta, float k) {
  const float cos2 = cos_i * cos_i;
  const float sin2 = 1 - cos2;
  const float t0 = eta * eta - k * k - sin2;
  const float a2_plus_b2 = std::sqrt(t0 * t0 + 4 * eta * eta * k * k);
  const float a = std::sqrt(std::max(0.0F, 0.5F * (a2_plus_b2 + t0)));
  const float t1 = a2_plus_b2 + cos2;
  const float t2 = 2 * a * cos_i;
  const float perpendicular = (t1 - t2) / (t1 + t2);
  const float t3 = cos2 * a2_plus_b2 + sin2 * sin2;
  const float t4 = t2 * sin2;
  const float parallel = perpendicular * (t3 - t4) / (t3 + t4);
  return 0.5F * (parallel + perpendicular);
}

inline Color FresnelConductor(float cos_i, Color eta, Color k) {
  return {FresnelConductor(cos_i, eta.x, k.x),
          FresnelConductor(cos_i, eta.y, k.y),
          FresnelConductor(cos_i, eta.z, k.z)};
}

}  // namespace nacre::render

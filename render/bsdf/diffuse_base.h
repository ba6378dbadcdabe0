#pragma once

#include "render/vec.h"

namespace nacre::render {

/// The diffuse base under a coat that lets through T(ω): light that entered bounces
/// between base (reflectance d) and the coat's inside (reflectance F_i) until it
/// leaves,
///   f = T(ω_i) T(ω_o) / η² · d / (π (1 − d F_i)).
/// F_i follows from the mean of T by reciprocity, 1 − F_i = T̄ / η², so that with d = 1
/// all the light that entered leaves again, whatever the table of T.
struct DiffuseBase {
  float inv_eta2 = 1;
  float internal_reflectance = 0;  ///< F_i
  bool nonlinear = false;

  static DiffuseBase Make(float eta, float mean_transmittance, bool nonlinear) {
    const float inv_eta2 = 1 / (eta * eta);
    return {inv_eta2, 1 - mean_transmittance * inv_eta2, nonlinear};
  }

  /// d / (1 − d F_i) / η²; without `nonlinear` the denominator is that of d = 1.
  Color Reflectance(Color d) const {
    if (!nonlinear) {
      return d * (inv_eta2 / (1 - internal_reflectance));
    }
    return {inv_eta2 * d.x / (1 - d.x * internal_reflectance),
            inv_eta2 * d.y / (1 - d.y * internal_reflectance),
            inv_eta2 * d.z / (1 - d.z * internal_reflectance)};
  }
};

}  // namespace nacre::render

#pragma once

#include "render/subsurface/radial_profile.h"

namespace nacre::render {

/// The diffuse reflectance profile of a semi-infinite homogeneous medium by the dipole
/// of Jensen et al. 2001, for one channel. With D = 1/(3 σ_t'), z_r = 1/σ_t',
/// A = (1 + F_dr)/(1 − F_dr), z_v = z_r (1 + 4A/3), σ_tr = √(3 σ_a σ_t') and
/// d_k² = r² + z_k²:
///   R_d(r) = α'/(4π) Σ_{k ∈ {r, v}} z_k (1 + σ_tr d_k) exp(−σ_tr d_k) / d_k³.
class DipoleProfile final : public PointSourceProfile {
 public:
  /// Coefficients in mm⁻¹, F_dr the diffuse reflectance of the surface from inside.
  /// Throws a usage Error for values that are negative or not finite, for both
  /// coefficients zero, or F_dr outside [0, 1).
  DipoleProfile(double sigma_a_per_mm,
                double sigma_s_prime_per_mm,
                double internal_reflectance);
};

}  // namespace nacre::render

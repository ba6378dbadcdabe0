#pragma once

#include "rigs/transport/dipole.h"

namespace nacre::rigs {

/// d'Eon's dipole [dEon12]: Grosjean's diffusion coefficient, exact Fresnel moments,
/// and an exitance made of fluence and flux, C_φ φ + C_E E. Multiple scattering only:
/// the light that left after one scattering is not in it. Per unit flux that entered a
/// semi-infinite medium at normal incidence.
class BetterDipole {
 public:
  /// Needs σ_s' > 0 and eta ≥ 1.
  BetterDipole(const DiffusionMedium& medium, double eta);

  /// R_d(r), mm⁻² [dEon12].
  double Reflectance(double r_mm) const;
  double TotalReflectance() const;

  /// The same for a unit source at any depth: what photon beam diffusion integrates.
  double SourceReflectance(double depth_mm, double r_mm) const;

 private:
  double albedo_;
  double sigma_tr_;
  double diffusion_mm_;
  double free_path_mm_;
  double extrapolation_mm_;
  double c_phi_;
  double c_e_;
};

}  // namespace nacre::rigs

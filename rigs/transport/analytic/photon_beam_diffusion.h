#pragma once

#include "rigs/transport/analytic/better_dipole.h"

namespace nacre::rigs {

/// Photon beam diffusion [Habel13] for a pencil that enters a semi-infinite medium at
/// normal incidence: sources all along the refracted beam, each with d'Eon and Irving's
/// dipole [dEon11] and Habel's empirical correction near the beam, and the light that
/// scattered once, exactly. Integrals to convergence, about ten digits.
class PhotonBeamDiffusion {
 public:
  /// Needs σ_s' > 0 and eta ≥ 1.
  PhotonBeamDiffusion(const DiffusionMedium& medium, double eta);

  /// Light that scattered more than once, mm⁻² [Habel13, eqs. 8–12]; `with_kappa`
  /// false leaves the correction factor out, as quantised diffusion does.
  double MultipleScattering(double r_mm, bool with_kappa = true) const;

  /// Light that scattered once, isotropically, and left through the rough-free surface
  /// [Habel13, eq. 15]. Nothing beyond the critical angle gets out.
  double SingleScattering(double r_mm) const;

  /// Their sum. Infinite at r = 0, as a pencil's is.
  double Reflectance(double r_mm) const {
    return MultipleScattering(r_mm) + SingleScattering(r_mm);
  }

 private:
  DiffusionMedium medium_;
  double eta_;
  BetterDipole dipole_;
};

}  // namespace nacre::rigs

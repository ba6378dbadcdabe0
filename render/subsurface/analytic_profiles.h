#pragma once

#include "render/subsurface/radial_profile.h"

#include <memory>

namespace nacre::render {

/// A homogeneous medium, for one channel.
struct Medium {
  double sigma_a_per_mm = 0;
  double sigma_s_prime_per_mm = 0;
  double eta = 1.5;
};

/// d'Eon's dipole [dEon12]: Grosjean's D = (2σ_a + σ_s')/(3 σ_t'²), A = (1 + 3C₂)/(1 −
/// 2C₁) of the Fresnel moments inside, and an exitance made of fluence and flux,
///   R_d = α'² (C_φ φ + C_E E), C_φ = (1 − 2C₁)/4, C_E = (1 − 3C₂)/2.
/// Light that leaves after one scattering isn't in it.
std::shared_ptr<const RadialProfile> MakeBetterDipole(const Medium& medium);

/// The same side of a slab between two like surfaces, by mirrored dipoles [Donner05,
/// eq. 10]: z_r,i = 2i(d + 2z_b) + z_r, z_v,i = 2i(d + 2z_b) − z_r − 2z_b. What comes
/// out of the other side is left out.
std::shared_ptr<const RadialProfile> MakeMultipole(const Medium& medium,
                                                   double thickness_mm);

/// Normalised diffusion [Christensen15]: with s = 1.85 − A + 7 |A − 0.8|³ (eq. 5, a
/// beam) and d = mean free path / s,
///   R_d(r) = A (exp(−r/d) + exp(−r/(3d))) / (8π d r), of total A.
std::shared_ptr<const RadialProfile> MakeNormalizedDiffusion(double albedo,
                                                             double mean_free_path_mm);

}  // namespace nacre::render

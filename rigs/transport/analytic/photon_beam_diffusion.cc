#include "rigs/transport/analytic/photon_beam_diffusion.h"

#include "core/fresnel.h"
#include "rigs/transport/analytic/internal/double_exponential.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::rigs {

PhotonBeamDiffusion::PhotonBeamDiffusion(const DiffusionMedium& medium, double eta)
    : medium_(medium), eta_(eta), dipole_(medium, eta) {}

double PhotonBeamDiffusion::MultipleScattering(double r_mm, bool with_kappa) const {
  const double sigma_t = medium_.SigmaTPrime();
  const auto source = [&](double z) {
    const double decay = std::exp(-sigma_t * z);
    if (decay == 0) {
      return 0.0;
    }
    const double d = std::hypot(r_mm, z);
    const double kappa = with_kappa ? -std::expm1(-2 * sigma_t * (d + z)) : 1.0;
    return sigma_t * decay * kappa * dipole_.SourceReflectance(z, r_mm);
  };
  return internal::IntegrateToInfinity(std::min(r_mm, 1 / sigma_t), source);
}

double PhotonBeamDiffusion::SingleScattering(double r_mm) const {
  const double sigma_t = medium_.SigmaTPrime();
  // Only from deeper than this is the surface met within the critical angle.
  const double least_mm = r_mm * std::sqrt(eta_ * eta_ - 1);
  const auto scattered = [&](double below_mm) {
    const double z = least_mm + below_mm;
    const double d = std::hypot(r_mm, z);
    const double attenuation = std::exp(-sigma_t * (z + d));
    return attenuation == 0
               ? 0.0
               : attenuation * z / (d * d * d) * FresnelTransmittance(z / d, 1 / eta_);
  };
  return medium_.sigma_s_prime_per_mm / (4 * std::numbers::pi) *
         internal::IntegrateToInfinity(std::min(r_mm, 1 / sigma_t), scattered);
}

}  // namespace nacre::rigs

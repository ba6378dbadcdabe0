#include "rigs/transport/dipole.h"

#include "core/error.h"
#include "core/fresnel.h"

#include <cmath>
#include <numbers>

namespace nacre::rigs {

double BoundaryFactor(double eta) {
  Expect(eta >= 1, "a refractive index of 1 or more");
  const double fdr = DiffuseFresnelReflectance(1 / eta);
  return (1 + fdr) / (1 - fdr);
}

double DiffusionMedium::SigmaTr() const {
  return std::sqrt(3 * sigma_a_per_mm * SigmaTPrime());
}

double SourceExitance(double z_mm, double r2_mm2, double sigma_tr_per_mm) {
  const double d2 = r2_mm2 + z_mm * z_mm;
  const double d = std::sqrt(d2);
  return z_mm * (1 + sigma_tr_per_mm * d) * std::exp(-sigma_tr_per_mm * d) /
         (4 * std::numbers::pi * d2 * d);
}

Dipole::Dipole(const DiffusionMedium& medium, double boundary_factor)
    : albedo_(medium.ReducedAlbedo()),
      sigma_tr_(medium.SigmaTr()),
      real_depth_mm_(1 / medium.SigmaTPrime()),
      virtual_height_mm_(real_depth_mm_ + 4 * boundary_factor * medium.DiffusionMm()) {
  Expect(medium.sigma_s_prime_per_mm > 0, "a scattering medium");
}

double Dipole::Reflectance(double r_mm) const {
  const double r2 = r_mm * r_mm;
  return albedo_ * (SourceExitance(real_depth_mm_, r2, sigma_tr_) +
                    SourceExitance(virtual_height_mm_, r2, sigma_tr_));
}

double Dipole::TotalReflectance() const {
  // A source's exitance integrates to exp(−σ_tr z) / 2.
  return 0.5 * albedo_ *
         (std::exp(-sigma_tr_ * real_depth_mm_) +
          std::exp(-sigma_tr_ * virtual_height_mm_));
}

}  // namespace nacre::rigs

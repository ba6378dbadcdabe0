#include "rigs/transport/analytic/better_dipole.h"

#include "core/error.h"
#include "rigs/transport/analytic/diffusion_laws.h"

#include <cmath>
#include <numbers>

namespace nacre::rigs {

BetterDipole::BetterDipole(const DiffusionMedium& medium, double eta)
    : albedo_(medium.ReducedAlbedo()),
      diffusion_mm_(DiffusionMm(DiffusionLaw::kGrosjean, medium)),
      free_path_mm_(1 / medium.SigmaTPrime()) {
  Expect(medium.sigma_s_prime_per_mm > 0, "a scattering medium");
  sigma_tr_ = std::sqrt(medium.sigma_a_per_mm / diffusion_mm_);
  extrapolation_mm_ = 2 * BoundaryFactor(BoundaryLaw::kDEon, eta) * diffusion_mm_;
  c_phi_ = 0.25 * (1 - 2 * InternalFresnelMoment(eta, 1));
  c_e_ = 0.5 * (1 - 3 * InternalFresnelMoment(eta, 2));
}

double BetterDipole::SourceReflectance(double depth_mm, double r_mm) const {
  const double r2 = r_mm * r_mm;
  const double image_mm = depth_mm + 2 * extrapolation_mm_;
  const double d_real = std::sqrt(r2 + depth_mm * depth_mm);
  const double d_image = std::sqrt(r2 + image_mm * image_mm);
  const double fluence = (std::exp(-sigma_tr_ * d_real) / d_real -
                          std::exp(-sigma_tr_ * d_image) / d_image) /
                         (4 * std::numbers::pi * diffusion_mm_);
  const double flux =
      SourceExitance(depth_mm, r2, sigma_tr_) + SourceExitance(image_mm, r2, sigma_tr_);
  // One albedo for the source, one because Grosjean's diffusion term is what is left
  // when the light that didn't scatter again is taken out.
  return albedo_ * albedo_ * (c_phi_ * fluence + c_e_ * flux);
}

double BetterDipole::Reflectance(double r_mm) const {
  return SourceReflectance(free_path_mm_, r_mm);
}

double BetterDipole::TotalReflectance() const {
  // ∫ e^(−σd)/(4πDd) = e^(−σz)/(2Dσ), of which the difference stays finite as σ → 0.
  const double real = std::exp(-sigma_tr_ * free_path_mm_);
  const double image_mm = free_path_mm_ + 2 * extrapolation_mm_;
  const double image = std::exp(-sigma_tr_ * image_mm);
  const double gap = 2 * extrapolation_mm_ * sigma_tr_;
  const double fluence =
      gap < 1e-9 ? extrapolation_mm_ / diffusion_mm_
                 : -real * std::expm1(-gap) / (2 * diffusion_mm_ * sigma_tr_);
  return albedo_ * albedo_ * (c_phi_ * fluence + c_e_ * 0.5 * (real + image));
}

}  // namespace nacre::rigs

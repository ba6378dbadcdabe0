#include "render/subsurface/dipole_profile.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::render {

using std::numbers::pi;

DipoleProfile::DipoleProfile(double sigma_a_per_mm,
                             double sigma_s_prime_per_mm,
                             double internal_reflectance) {
  const double sigma_t = sigma_a_per_mm + sigma_s_prime_per_mm;
  if (!(sigma_a_per_mm >= 0 && sigma_s_prime_per_mm >= 0 && sigma_t > 0 &&
        std::isfinite(sigma_t))) {
    throw UsageError(
        fmt::format("a dipole with sigma_a {} and sigma_s' {} per mm: both "
                    "have to be finite and not negative, one not zero",
                    sigma_a_per_mm,
                    sigma_s_prime_per_mm));
  }
  if (!(internal_reflectance >= 0 && internal_reflectance < 1)) {
    throw UsageError(fmt::format("a dipole's internal reflectance {} isn't in [0, 1)",
                                 internal_reflectance));
  }
  const double a = (1 + internal_reflectance) / (1 - internal_reflectance);
  albedo_ = sigma_s_prime_per_mm / sigma_t;
  sigma_tr_ = std::sqrt(3 * sigma_a_per_mm * sigma_t);
  z_real_ = 1 / sigma_t;
  z_virtual_ = z_real_ * (1 + 4 * a / 3);
}

double DipoleProfile::Rd(double r_mm) const {
  double sum = 0;
  for (const double z : {z_real_, z_virtual_}) {
    const double d = std::hypot(r_mm, z);
    const double s = sigma_tr_ * d;
    sum += z * (1 + s) * std::exp(-s) / (d * d * d);
  }
  return albedo_ / (4 * pi) * sum;
}

DipoleProfile::Spread DipoleProfile::SpreadTerms(double r_mm) const {
  // With q = r²: R'/r = 2 dR/dq and (R'' − R'/r)/(2 r²) = 2 d²R/dq².
  Spread sum{0, 0};
  for (const double z : {z_real_, z_virtual_}) {
    const double d = std::hypot(r_mm, z);
    const double s = sigma_tr_ * d;
    const double d5 = d * d * d * d * d;
    const double decay = albedo_ / (4 * pi) * z * std::exp(-s);
    sum.slope -= decay * (3 + s * (3 + s)) / d5;
    sum.bend += decay * (15 + s * (15 + s * (6 + s))) / (2 * d5 * d * d);
  }
  return sum;
}

double DipoleProfile::FluxWithin(double r_mm) const {
  // r dr = d dd, and z (1 + σd) exp(−σd)/d² has the antiderivative −z exp(−σd)/d.
  double sum = 0;
  for (const double z : {z_real_, z_virtual_}) {
    const double d = std::hypot(r_mm, z);
    sum += std::exp(-sigma_tr_ * z) - z / d * std::exp(-sigma_tr_ * d);
  }
  return albedo_ / 2 * sum;
}

double DipoleProfile::Total() const {
  return albedo_ / 2 *
         (std::exp(-sigma_tr_ * z_real_) + std::exp(-sigma_tr_ * z_virtual_));
}

double DipoleProfile::DiscMean(double r_mm, double disc_mm) const {
  if (disc_mm < 1e-3 * z_real_) {
    return Rd(r_mm);
  }
  // In polar coordinates around x_o the radial integral is closed; over the angle the
  // midpoint rule converges fast, once the square roots at the tangents are smoothed
  // away by sin φ = (disc / r) sin ψ.
  constexpr int kSteps = 48;
  double sum = 0;
  if (r_mm <= disc_mm) {
    for (int i = 0; i < kSteps; ++i) {
      const double phi = pi * (i + 0.5) / kSteps;
      const double across = r_mm * std::sin(phi);
      const double edge = r_mm * std::cos(phi) +
                          std::sqrt(std::max(0.0, disc_mm * disc_mm - across * across));
      sum += FluxWithin(edge);
    }
    return sum / kSteps / (pi * disc_mm * disc_mm);
  }
  for (int i = 0; i < kSteps; ++i) {
    const double psi = 0.5 * pi * (i + 0.5) / kSteps;
    const double sin_phi = disc_mm / r_mm * std::sin(psi);
    const double cos_phi = std::sqrt(1 - sin_phi * sin_phi);
    const double half_chord = disc_mm * std::cos(psi);
    const double dphi = disc_mm / r_mm * std::cos(psi) / cos_phi;
    sum += dphi * (FluxWithin(r_mm * cos_phi + half_chord) -
                   FluxWithin(r_mm * cos_phi - half_chord));
  }
  // φ runs over ±, and the full circle is 2π: (1/2π) · 2 · (π/2 / steps) · Σ.
  return sum / (2 * kSteps) / (pi * disc_mm * disc_mm);
}

}  // namespace nacre::render

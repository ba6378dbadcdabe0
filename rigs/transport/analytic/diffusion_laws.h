#pragma once

#include "rigs/transport/dipole.h"

namespace nacre::rigs {

/// C_k = ∫₀¹ F(μ) μᵏ dμ for light inside a medium of index `eta` ≥ 1, by quadrature to
/// 1e-10. 2 C₁ is F_dr.
double InternalFresnelMoment(double eta, int power);

/// Which diffusion coefficient.
enum class DiffusionLaw {
  kClassical,  ///< D = 1 / (3 σ_t')
  kGrosjean,   ///< D = (2 σ_a + σ_s') / (3 σ_t'²) [dEon11, eq. 5]
};

/// Which A in φ = 2 A D ∂φ/∂z at the surface.
enum class BoundaryLaw {
  kExact,       ///< (1 + 2C₁) / (1 − 2C₁), moments by quadrature [Groenhuis83]
  kPolynomial,  ///< the same with the polynomial for F_dr [Jensen01]
  kDEon,        ///< (1 + 3C₂) / (1 − 2C₁) [dEon11], exact moments
};

double DiffusionMm(DiffusionLaw law, const DiffusionMedium& medium);

/// 1 for eta = 1 (except kPolynomial, which isn't exact there). Needs eta ≥ 1.
double BoundaryFactor(BoundaryLaw law, double eta);

/// F_dr = −1.440 / η² + 0.710 / η + 0.668 + 0.0636 η [Jensen01, sec. 2.3].
double PolynomialFdr(double eta);

}  // namespace nacre::rigs

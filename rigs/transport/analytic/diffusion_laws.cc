#include "rigs/transport/analytic/diffusion_laws.h"

#include "core/error.h"
#include "core/fresnel.h"
#include "rigs/internal/gauss_legendre.h"

#include <cmath>
#include <cstddef>

namespace nacre::rigs {

double InternalFresnelMoment(double eta, int power) {
  Expect(eta >= 1, "a refractive index of 1 or more");
  // Below the critical cosine everything is reflected. Above it F leaves 1 with a
  // square root, which μ = critical + (1 − critical) s⁴ smooths.
  const double critical = std::sqrt(1 - 1 / (eta * eta));
  double moment = std::pow(critical, power + 1) / (power + 1);
  const rigs::internal::GaussRule rule = rigs::internal::GaussLegendre(96);
  const double span = 1 - critical;
  for (std::size_t k = 0; k < rule.node.size(); ++k) {
    const double s = 0.5 * (1 + rule.node[k]);
    const double mu = critical + span * s * s * s * s;
    moment += 0.5 * rule.weight[k] * span * 4 * s * s * s *
              FresnelReflectance(mu, 1 / eta) * std::pow(mu, power);
  }
  return moment;
}

double DiffusionMm(DiffusionLaw law, const DiffusionMedium& medium) {
  const double sigma_t = medium.SigmaTPrime();
  return law == DiffusionLaw::kClassical
             ? 1 / (3 * sigma_t)
             : (medium.sigma_a_per_mm + sigma_t) / (3 * sigma_t * sigma_t);
}

double PolynomialFdr(double eta) {
  return -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
}

double BoundaryFactor(BoundaryLaw law, double eta) {
  switch (law) {
    case BoundaryLaw::kExact:
      return BoundaryFactor(eta);
    case BoundaryLaw::kPolynomial:
      return (1 + PolynomialFdr(eta)) / (1 - PolynomialFdr(eta));
    case BoundaryLaw::kDEon:
      return (1 + 3 * InternalFresnelMoment(eta, 2)) /
             (1 - 2 * InternalFresnelMoment(eta, 1));
  }
  throw LogicError("a boundary law of no kind");
}

}  // namespace nacre::rigs

#include "core/fresnel.h"

#include "core/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace nacre {

double FresnelReflectance(double cos_i, double eta) {
  Expect(eta > 0, "a positive ratio of refractive indices");
  const double mu = std::clamp(cos_i, 0.0, 1.0);
  const double sin2_t = (1 - mu * mu) / (eta * eta);
  if (sin2_t >= 1) {
    return 1;
  }
  const double mu_t = std::sqrt(1 - sin2_t);
  const double parallel = (eta * mu - mu_t) / (eta * mu + mu_t);
  const double perpendicular = (mu - eta * mu_t) / (mu + eta * mu_t);
  return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

double FresnelTransmittance(double cos_i, double eta) {
  return 1 - FresnelReflectance(cos_i, eta);
}

namespace {

// ∫ 2 F(μ) μ dμ over [low, high], with μ = low + (high − low) s²: the square root with
// which F leaves the critical angle becomes smooth. Composite Gauss–Legendre, 5 points
// a panel.
double FresnelMoment(double low, double high, double eta) {
  constexpr std::array<double, 5> kNode = {-0.9061798459386640,
                                           -0.5384693101056831,
                                           0.0,
                                           0.5384693101056831,
                                           0.9061798459386640};
  constexpr std::array<double, 5> kWeight = {0.2369268850561891,
                                             0.4786286704993665,
                                             0.5688888888888889,
                                             0.4786286704993665,
                                             0.2369268850561891};
  constexpr int kPanels = 64;
  double sum = 0;
  for (int panel = 0; panel < kPanels; ++panel) {
    for (std::size_t k = 0; k < kNode.size(); ++k) {
      const double s = (panel + 0.5 * (1 + kNode[k])) / kPanels;
      const double mu = low + (high - low) * s * s;
      const double dmu = (high - low) * 2 * s;
      sum += kWeight[k] * 2 * FresnelReflectance(mu, eta) * mu * dmu;
    }
  }
  return sum * 0.5 / kPanels;
}

}  // namespace

double DiffuseFresnelReflectance(double eta) {
  Expect(eta > 0, "a positive ratio of refractive indices");
  if (eta >= 1) {
    return FresnelMoment(0, 1, eta);
  }
  const double critical =
      std::sqrt(1 - eta * eta);  // below this cosine all is reflected
  return critical * critical + FresnelMoment(critical, 1, eta);
}

double ExitNormalization(double eta) {
  return 1 - DiffuseFresnelReflectance(eta);
}

}  // namespace nacre

#include "render/subsurface/analytic_profiles.h"

#include "core/error.h"
#include "core/fresnel.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::render {
namespace {

using std::numbers::pi;

void Check(const Medium& m) {
  const double sigma_t = m.sigma_a_per_mm + m.sigma_s_prime_per_mm;
  if (!(m.sigma_a_per_mm >= 0 && m.sigma_s_prime_per_mm >= 0 && sigma_t > 0 &&
        std::isfinite(sigma_t) && m.eta >= 1 && std::isfinite(m.eta))) {
    throw UsageError(fmt::format(
        "a medium with sigma_a {} and sigma_s' {} per mm and index {}: coefficients "
        "have to be finite and not negative, one not zero, the index at least 1",
        m.sigma_a_per_mm,
        m.sigma_s_prime_per_mm,
        m.eta));
  }
}

// ∫₀¹ F(μ) μ² dμ for light inside. Below the critical angle F is 1; above it
// μ = μ_c + (1 − μ_c) t² takes the root out of F.
double SecondFresnelMoment(double eta) {
  const double critical = std::sqrt(1 - 1 / (eta * eta));
  const auto integrand = [&](double t) {
    const double mu = critical + (1 - critical) * t * t;
    return FresnelReflectance(std::min(1.0, mu), 1 / eta) * mu * mu * 2 *
           (1 - critical) * t;
  };
  constexpr int kSteps = 512;  // Simpson's rule
  double sum = integrand(0) + integrand(1);
  for (int n = 1; n < kSteps; ++n) {
    sum += (n % 2 == 1 ? 4 : 2) * integrand(static_cast<double>(n) / kSteps);
  }
  return critical * critical * critical / 3 + sum / (3 * kSteps);
}

// c exp(−k r)/r, twice.
class NormalizedDiffusion final : public RadialProfile {
 public:
  NormalizedDiffusion(double albedo, double d_mm) : albedo_(albedo), d_mm_(d_mm) {}

  double Rd(double r_mm) const override {
    return Scale() * (std::exp(-r_mm / d_mm_) + std::exp(-r_mm / (3 * d_mm_))) / r_mm;
  }
  Spread SpreadTerms(double r_mm) const override {
    Spread sum{0, 0};
    for (const double k : {1 / d_mm_, 1 / (3 * d_mm_)}) {
      const double s = k * r_mm;
      const double value = Scale() * std::exp(-s) / (r_mm * r_mm * r_mm);
      sum.slope -= value * (1 + s);
      sum.bend += value * (3 + s * (3 + s)) / (2 * r_mm * r_mm);
    }
    return sum;
  }
  double FluxWithin(double r_mm) const override {
    return albedo_ *
           (1 - 0.25 * std::exp(-r_mm / d_mm_) - 0.75 * std::exp(-r_mm / (3 * d_mm_)));
  }
  double Total() const override { return albedo_; }
  double MeanFreePathMm() const override { return d_mm_; }
  double EffectiveTransportPerMm() const override { return 1 / (3 * d_mm_); }

 private:
  double Scale() const { return albedo_ / (8 * pi * d_mm_); }
  double albedo_;
  double d_mm_;
};

}  // namespace

std::shared_ptr<const RadialProfile> MakeBetterDipole(const Medium& medium) {
  Check(medium);
  const double sigma_t = medium.sigma_a_per_mm + medium.sigma_s_prime_per_mm;
  const double albedo = medium.sigma_s_prime_per_mm / sigma_t;
  const double diffusion = (2 * medium.sigma_a_per_mm + medium.sigma_s_prime_per_mm) /
                           (3 * sigma_t * sigma_t);
  const double twice_c1 = DiffuseFresnelReflectance(1 / medium.eta);
  const double thrice_c2 = 3 * SecondFresnelMoment(medium.eta);
  const double z_b = 2 * diffusion * (1 + thrice_c2) / (1 - twice_c1);
  const double z_r = 1 / sigma_t;
  const double flux = albedo * albedo * 0.5 * (1 - thrice_c2) / (4 * pi);
  const double fluence = albedo * albedo * 0.25 * (1 - twice_c1) / (4 * pi * diffusion);
  return std::make_shared<PointSourceProfile>(
      std::vector<PointSourceProfile::Source>{{z_r, flux, fluence},
                                              {z_r + 2 * z_b, flux, -fluence}},
      std::sqrt(medium.sigma_a_per_mm / diffusion),
      z_r);
}

std::shared_ptr<const RadialProfile> MakeMultipole(const Medium& medium,
                                                   double thickness_mm) {
  Check(medium);
  if (!(thickness_mm > 0 && std::isfinite(thickness_mm))) {
    throw UsageError(fmt::format("a slab {} mm thick: the thickness has to be positive",
                                 thickness_mm));
  }
  const double sigma_t = medium.sigma_a_per_mm + medium.sigma_s_prime_per_mm;
  const double reflectance = DiffuseFresnelReflectance(1 / medium.eta);
  const double z_r = 1 / sigma_t;
  const double z_b = 2 * (1 + reflectance) / (1 - reflectance) / (3 * sigma_t);
  const double weight = medium.sigma_s_prime_per_mm / sigma_t / (4 * pi);
  const double sigma_tr = std::sqrt(3 * medium.sigma_a_per_mm * sigma_t);
  std::vector<PointSourceProfile::Source> sources;
  // Source and mirror image: from a hundred pairs on they cancel to many digits.
  constexpr int kPairs = 100;
  for (int i = -kPairs; i <= kPairs; ++i) {
    const double shift = 2 * i * (thickness_mm + 2 * z_b);
    const double real = shift + z_r;
    const double image = shift - z_r - 2 * z_b;
    // exp(−40) of what is nearest is below a double's digits.
    constexpr double kGone = 40;
    if (sigma_tr * std::min(std::abs(real), std::abs(image)) > kGone) {
      continue;
    }
    sources.push_back({std::abs(real), std::copysign(weight, real), 0});
    sources.push_back({std::abs(image), std::copysign(weight, -image), 0});
  }
  return std::make_shared<PointSourceProfile>(std::move(sources), sigma_tr, z_r);
}

std::shared_ptr<const RadialProfile> MakeNormalizedDiffusion(double albedo,
                                                             double mean_free_path_mm) {
  if (!(albedo >= 0 && albedo <= 1 && mean_free_path_mm > 0 &&
        std::isfinite(mean_free_path_mm))) {
    throw UsageError(
        fmt::format("normalised diffusion of albedo {} and mean free path {} mm: the "
                    "one has to be in [0, 1], the other positive",
                    albedo,
                    mean_free_path_mm));
  }
  const double off = std::abs(albedo - 0.8);
  const double s = 1.85 - albedo + 7 * off * off * off;
  return std::make_shared<NormalizedDiffusion>(albedo, mean_free_path_mm / s);
}

}  // namespace nacre::render

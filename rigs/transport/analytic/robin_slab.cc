#include "rigs/transport/analytic/robin_slab.h"

#include "core/error.h"
#include "rigs/transport/analytic/internal/double_exponential.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace nacre::rigs {
namespace {

using std::numbers::pi;

// Modes are kept up to κ_n r = this at the nearest distance they are used for.
constexpr double kLastExponent = 34;
constexpr double kNearestInThickness = 0.02;

}  // namespace

RobinSlab::RobinSlab(const RobinSlabSetup& setup)
    : setup_(setup),
      sigma_tr_(std::sqrt(setup.medium.sigma_a_per_mm / setup.diffusion_mm)),
      top_extrapolation_mm_(2 * setup.top_factor * setup.diffusion_mm),
      bottom_extrapolation_mm_(2 * setup.bottom_factor * setup.diffusion_mm) {
  Expect(setup.diffusion_mm > 0 && setup.medium.SigmaTPrime() > 0,
         "a medium that attenuates");
  if (std::isfinite(setup_.thickness_mm)) {
    nearest_mm_ = kNearestInThickness * setup_.thickness_mm;
    FindModes();
    near_offset_ = SumModes(nearest_mm_, &Mode::top) - ThickReflectance(nearest_mm_);
  }
}

// φ = Σ S_n / N_n · sin(k_n z + δ_n) K₀(κ_n r) / (2πD) with tan δ = z_b k at the top
// and k d + δ + δ' = nπ from the bottom's own condition, κ_n² = σ_a / D + k_n².
void RobinSlab::FindModes() {
  const double d = setup_.thickness_mm;
  const double sigma_t = setup_.medium.SigmaTPrime();
  const double last = std::hypot(sigma_tr_, kLastExponent / nearest_mm_);
  const auto phase = [](double k, double extrapolation_mm) {
    return std::isinf(extrapolation_mm) ? 0.5 * pi : std::atan(k * extrapolation_mm);
  };
  const auto slope = [](double k, double extrapolation_mm) {
    return std::isinf(extrapolation_mm)
               ? 0.0
               : extrapolation_mm / (1 + k * extrapolation_mm * k * extrapolation_mm);
  };
  for (int n = 1;; ++n) {
    double k = n * pi / (d + 0.5 * pi * top_extrapolation_mm_);
    k = std::min(k, n * pi / d);
    for (int step = 0; step < 60; ++step) {
      const double excess = k * d + phase(k, top_extrapolation_mm_) +
                            phase(k, bottom_extrapolation_mm_) - n * pi;
      const double change = excess / (d + slope(k, top_extrapolation_mm_) +
                                      slope(k, bottom_extrapolation_mm_));
      k = std::max(k - change, 1e-3 * k);
      if (std::abs(change) < 1e-15 * k) {
        break;
      }
    }
    const double decay = std::hypot(sigma_tr_, k);
    const double delta = phase(k, top_extrapolation_mm_);
    const double norm =
        0.5 * d - (std::sin(2 * (k * d + delta)) - std::sin(2 * delta)) / (4 * k);
    const std::complex<double> rate(sigma_t, -k);
    const std::complex<double> beam =
        std::polar(1.0, delta) * (1.0 - std::exp(-rate * d)) / rate;
    double source = setup_.medium.sigma_s_prime_per_mm * beam.imag();
    const double at_bottom = std::sin(k * d + delta);
    if (std::isinf(setup_.bottom_factor)) {
      source += std::exp(-sigma_t * d) * at_bottom;
    }
    const double amplitude = source / (norm * 2 * pi);
    modes_.push_back({decay,
                      amplitude * std::sin(delta) / top_extrapolation_mm_,
                      std::isinf(bottom_extrapolation_mm_)
                          ? 0
                          : amplitude * at_bottom / bottom_extrapolation_mm_});
    if (decay > last) {
      return;
    }
  }
}

double RobinSlab::SumModes(double r_mm, double Mode::*face) const {
  double sum = 0;
  for (const Mode& mode : modes_) {
    const double x = mode.decay * r_mm;
    if (x > kLastExponent + modes_.front().decay * r_mm || x > 700) {
      break;
    }
    sum += mode.*face * std::cyl_bessel_k(0.0, x);
  }
  return sum;
}

// In the plane's spatial frequencies a source at depth z leaves with
// exp(−κz) / (1 + z_b κ); the second factor is ∫ exp(−t − z_b κ t) dt: more sources
// above. Beam and boundary together are a line of sources of density
// σ_t' / (σ_t' z_b − 1) · (exp(−u / z_b) − exp(−σ_t' u)) at "depths" u.
double RobinSlab::ThickReflectance(double r_mm) const {
  const double sigma_t = setup_.medium.SigmaTPrime();
  const double q = 1 / top_extrapolation_mm_;
  const double gap = sigma_t - q;
  const auto line = [&](double u) {
    const double x = gap * u;
    // The slower exponential in front, so that nothing overflows.
    const double slow = std::exp(-std::min(q, sigma_t) * u);
    const double density = std::abs(x) < 1e-6
                               ? u * slow * (1 - 0.5 * std::abs(x))
                               : -slow * std::expm1(-std::abs(x)) / std::abs(gap);
    return density == 0 ? 0.0 : density * 2 * SourceExitance(u, r_mm * r_mm, sigma_tr_);
  };
  return setup_.medium.sigma_s_prime_per_mm * q *
         internal::IntegrateToInfinity(std::min(r_mm, 1 / sigma_t), line);
}

double RobinSlab::Reflectance(double r_mm) const {
  if (r_mm < nearest_mm_ || modes_.empty()) {
    return ThickReflectance(r_mm) + near_offset_;
  }
  return SumModes(r_mm, &Mode::top);
}

double RobinSlab::Transmittance(double r_mm) const {
  return SumModes(std::max(r_mm, nearest_mm_), &Mode::bottom);
}

double RobinSlab::SlowestDecayPerMm() const {
  return modes_.empty() ? sigma_tr_ : modes_.front().decay;
}

// The same in one dimension: φ = P e^(−σz) + Q e^(−κz) + S e^(κ(z−d)).
RobinSlab::Ends RobinSlab::SurfaceFluence() const {
  const double s = setup_.medium.SigmaTPrime();
  const bool finite = std::isfinite(setup_.thickness_mm);
  const double d = finite ? setup_.thickness_mm : 1;
  double kappa = std::max(sigma_tr_, 1e-7 / (finite ? d : top_extrapolation_mm_));
  if (std::abs(kappa / s - 1) < 1e-6) {
    kappa = s * (1 + 1e-6);  // the closed form is 0/0 there, its limit is smooth
  }
  const double p = setup_.medium.sigma_s_prime_per_mm /
                   (setup_.diffusion_mm * (kappa * kappa - s * s));
  const double zt = top_extrapolation_mm_;
  if (!finite) {
    return {p * zt * (kappa - s) / (1 + zt * kappa), 0};
  }
  // Row 1, φ − z_t φ' = 0 at the top. Row 2, φ + z_b φ' = 0 at the bottom, or D φ' =
  // the unscattered light that a closed bottom turns back.
  const double e = std::exp(-kappa * d);
  const double beam = std::exp(-s * d);
  const double a11 = 1 + zt * kappa;
  const double a12 = e * (1 - zt * kappa);
  const double b1 = -p * (1 + zt * s);
  double a21 = -kappa * e;
  double a22 = kappa;
  double b2 = beam / setup_.diffusion_mm + p * s * beam;
  if (std::isfinite(bottom_extrapolation_mm_)) {
    const double zb = bottom_extrapolation_mm_;
    a21 = e * (1 - zb * kappa);
    a22 = 1 + zb * kappa;
    b2 = -p * beam * (1 - zb * s);
  }
  const double determinant = a11 * a22 - a12 * a21;
  const double down = (b1 * a22 - a12 * b2) / determinant;
  const double up = (a11 * b2 - b1 * a21) / determinant;
  return {p + down + up * e, p * beam + down * e + up};
}

double RobinSlab::TotalReflectance() const {
  return SurfaceFluence().top / (2 * setup_.top_factor);
}

double RobinSlab::TotalTransmittance() const {
  if (std::isinf(setup_.thickness_mm) || std::isinf(setup_.bottom_factor)) {
    return 0;
  }
  return SurfaceFluence().bottom / (2 * setup_.bottom_factor) +
         std::exp(-setup_.medium.SigmaTPrime() * setup_.thickness_mm);
}

}  // namespace nacre::rigs

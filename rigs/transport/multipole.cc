#include "rigs/transport/multipole.h"

#include "core/error.h"

#include <cmath>
#include <numbers>

namespace nacre::rigs {
namespace {

using std::numbers::pi;

// Relative size at which a series is cut.
constexpr double kNegligible = 1e-10;

}  // namespace

Multipole::Multipole(const DiffusionMedium& medium, const SlabBoundary& slab)
    : albedo_(medium.ReducedAlbedo()),
      sigma_tr_(medium.SigmaTr()),
      thickness_mm_(slab.thickness_mm),
      top_extrapolation_mm_(2 * slab.top_factor * medium.DiffusionMm()),
      transmits_(!slab.bottom_reflects_all) {
  Expect(medium.sigma_s_prime_per_mm > 0, "a scattering medium");
  const double depth_mm = 1 / medium.SigmaTPrime();
  Expect(depth_mm < thickness_mm_ && std::isfinite(thickness_mm_),
         "a finite slab that is thicker than a mean free path");
  double bottom_extrapolation_mm = 2 * slab.bottom_factor * medium.DiffusionMm();
  source_depths_mm_ = {depth_mm};
  if (slab.bottom_reflects_all) {
    thickness_mm_ = 2 * slab.thickness_mm;
    bottom_extrapolation_mm = top_extrapolation_mm_;
    source_depths_mm_.push_back(thickness_mm_ - depth_mm);
  }
  period_mm_ = 2 * (thickness_mm_ + top_extrapolation_mm_ + bottom_extrapolation_mm);
}

// Upward flux through the plane at that depth: z_r,i = iP + l, z_v,i = iP − l − 2 z_b
// [Donner05, eqs. 7–8], heights counted from the plane.
double Multipole::SumImages(double plane_mm, double r2_mm2) const {
  constexpr int kMostPairs = 1000;
  double total = 0;
  for (const double depth_mm : source_depths_mm_) {
    const double virtual_mm = -depth_mm - 2 * top_extrapolation_mm_;
    const auto pair = [&](double shift_mm) {
      return SourceExitance(shift_mm + depth_mm - plane_mm, r2_mm2, sigma_tr_) -
             SourceExitance(shift_mm + virtual_mm - plane_mm, r2_mm2, sigma_tr_);
    };
    double sum = pair(0);
    for (int i = 1; i <= kMostPairs; ++i) {
      // Opposite shifts nearly cancel, so they are judged together.
      const double term = pair(i * period_mm_) + pair(-i * period_mm_);
      sum += term;
      if (std::abs(term) < kNegligible * std::abs(sum)) {
        break;
      }
    }
    total += sum;
  }
  return albedo_ * total;
}

// The same as modes sin(k_n (z + z_b)), k_n = nπ / H, H = P / 2; each spreads as
// K₀(r √(σ_tr² + k_n²)).
double Multipole::SumModes(double plane_mm, double r_mm) const {
  constexpr int kMostModes = 100;
  const double height_mm = 0.5 * period_mm_;
  double sum = 0;
  for (int n = 1; n <= kMostModes; ++n) {
    const double k = n * pi / height_mm;
    const double decay = std::hypot(sigma_tr_, k);
    if (decay * r_mm > 700) {  // below the smallest double
      break;
    }
    double amplitude = 0;
    for (const double depth_mm : source_depths_mm_) {
      amplitude += std::sin(k * (depth_mm + top_extrapolation_mm_));
    }
    const double spread = k * std::cyl_bessel_k(0.0, decay * r_mm);
    sum += amplitude * std::cos(k * (plane_mm + top_extrapolation_mm_)) * spread;
    if (spread < kNegligible * std::abs(sum)) {
      break;
    }
  }
  return albedo_ * sum / (pi * height_mm);
}

double Multipole::Flux(double plane_mm, double r_mm) const {
  return r_mm < 0.5 * period_mm_ ? SumImages(plane_mm, r_mm * r_mm)
                                 : SumModes(plane_mm, r_mm);
}

double Multipole::Reflectance(double r_mm) const {
  return Flux(0, r_mm);
}

double Multipole::Transmittance(double r_mm) const {
  return transmits_ ? -Flux(thickness_mm_, r_mm) : 0;
}

// An image at height z above the plane contributes sign(z) exp(−σ_tr |z|) / 2; the
// images above and below each form a geometric series. Written for σ_tr → 0 too.
double Multipole::TotalReflectance() const {
  double total = 0;
  for (const double depth_mm : source_depths_mm_) {
    const double real = depth_mm;
    const double virtual_mm = depth_mm + 2 * top_extrapolation_mm_;
    if (sigma_tr_ * period_mm_ < 1e-6) {
      total += 2 - 2 * (real + virtual_mm) / period_mm_;
      continue;
    }
    const double s = sigma_tr_;
    const double per_round = -std::expm1(-s * period_mm_);
    // exp(−sP) · 2 sinh(sx), without overflow.
    const auto returned = [&](double x) {
      return (std::exp(s * (x - period_mm_)) - std::exp(-s * (x + period_mm_))) /
             per_round;
    };
    total += std::exp(-s * real) + std::exp(-s * virtual_mm) - returned(real) -
             returned(virtual_mm);
  }
  return 0.5 * albedo_ * total;
}

double Multipole::TotalTransmittance() const {
  if (!transmits_) {
    return 0;
  }
  const double depth_mm = source_depths_mm_.front();
  const double virtual_mm = depth_mm + 2 * top_extrapolation_mm_;
  const double near_mm = thickness_mm_ - depth_mm;
  const double far_mm = thickness_mm_ + virtual_mm;
  if (sigma_tr_ * period_mm_ < 1e-6) {
    return albedo_ * (depth_mm + virtual_mm) / period_mm_;
  }
  const double s = sigma_tr_;
  const double per_round = -std::expm1(-s * period_mm_);
  const auto returned = [&](double x) {
    return (std::exp(s * (x - period_mm_)) - std::exp(-s * (x + period_mm_))) /
           per_round;
  };
  return 0.5 * albedo_ *
         (std::exp(-s * near_mm) - std::exp(-s * far_mm) + returned(far_mm) -
          returned(near_mm));
}

}  // namespace nacre::rigs

#include "render/subsurface/radial_profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::render {

using std::numbers::pi;

double RadialProfile::DiscMean(double r_mm, double disc_mm) const {
  if (disc_mm < 1e-3 * MeanFreePathMm()) {
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

PointSourceProfile::PointSourceProfile(std::vector<Source> sources,
                                       double sigma_tr_per_mm,
                                       double mean_free_path_mm)
    : sources_(std::move(sources)),
      sigma_tr_(sigma_tr_per_mm),
      mean_free_path_mm_(mean_free_path_mm) {}

double PointSourceProfile::Rd(double r_mm) const {
  double sum = 0;
  for (const Source& source : sources_) {
    const double d = std::hypot(r_mm, source.depth_mm);
    const double s = sigma_tr_ * d;
    sum += (source.flux * source.depth_mm * (1 + s) / (d * d) + source.fluence) *
           std::exp(-s) / d;
  }
  return sum;
}

RadialProfile::Spread PointSourceProfile::SpreadTerms(double r_mm) const {
  // With q = r²: R'/r = 2 dR/dq and (R'' − R'/r)/(2 r²) = 2 d²R/dq².
  Spread sum{0, 0};
  for (const Source& source : sources_) {
    const double d = std::hypot(r_mm, source.depth_mm);
    const double s = sigma_tr_ * d;
    const double decay = std::exp(-s);
    const double d3 = d * d * d;
    const double d5 = d3 * d * d;
    const double flux = source.flux * source.depth_mm * decay;
    const double fluence = source.fluence * decay;
    sum.slope -= flux * (3 + s * (3 + s)) / d5 + fluence * (1 + s) / d3;
    sum.bend += flux * (15 + s * (15 + s * (6 + s))) / (2 * d5 * d * d) +
                fluence * (3 + s * (3 + s)) / (2 * d5);
  }
  return sum;
}

double PointSourceProfile::FluxWithin(double r_mm) const {
  // r dr = d dd. z (1 + σd) exp(−σd)/d² has the antiderivative −z exp(−σd)/d, and
  // exp(−σd) has −exp(−σd)/σ, whose difference stays finite as σ → 0.
  double sum = 0;
  for (const Source& source : sources_) {
    const double z = source.depth_mm;
    const double d = std::hypot(r_mm, z);
    const double at_axis = std::exp(-sigma_tr_ * z);
    const double away = sigma_tr_ * (d - z);
    const double fluence = away > 1e-9 ? -std::expm1(-away) / sigma_tr_ : d - z;
    sum += source.flux * (at_axis - z / d * std::exp(-sigma_tr_ * d)) +
           source.fluence * at_axis * fluence;
  }
  return 2 * pi * sum;
}

double PointSourceProfile::Total() const {
  double sum = 0;
  for (const Source& source : sources_) {
    sum += source.flux * std::exp(-sigma_tr_ * source.depth_mm);
  }
  // Without absorption the fluence's part is finite only for weights that cancel, and
  // then it is Σ −v z.
  for (const Source& source : sources_) {
    sum += source.fluence * (sigma_tr_ > 1e-9
                                 ? std::exp(-sigma_tr_ * source.depth_mm) / sigma_tr_
                                 : -source.depth_mm);
  }
  return 2 * pi * sum;
}

}  // namespace nacre::render

#include "render/subsurface/radial_density.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::render {
namespace {

constexpr std::size_t kRings = 256;
constexpr double kEvenShare = 0.05;

}  // namespace

RadialDensity::RadialDensity(const std::function<double(double)>& weight,
                             double finest_mm,
                             double reach_mm)
    : reach_mm_(static_cast<float>(reach_mm)) {
  Expect(finest_mm > 0 && reach_mm > finest_mm, "a radial density over some distance");
  const double step = std::log(reach_mm / finest_mm) / (kRings - 1);
  log_finest_ = static_cast<float>(std::log(finest_mm));
  per_log_ = static_cast<float>(1 / step);
  // Edges are the floats that Sample and Pdf see; areas are taken between them.
  edges_.push_back(0);
  for (std::size_t n = 0; n < kRings; ++n) {
    edges_.push_back(
        static_cast<float>(finest_mm * std::exp(step * static_cast<double>(n))));
  }
  edges_.back() = reach_mm_;
  const auto area = [&](std::size_t ring) {
    const auto inner = static_cast<double>(edges_[ring]);
    const auto outer = static_cast<double>(edges_[ring + 1]);
    return std::numbers::pi * (outer - inner) * (outer + inner);
  };
  std::vector<double> mass(kRings);
  double sum = 0;
  for (std::size_t ring = 0; ring < kRings; ++ring) {
    const double middle = 0.5 * static_cast<double>(edges_[ring] + edges_[ring + 1]);
    mass[ring] = std::max(0.0, weight(middle)) * area(ring);
    sum += mass[ring];
  }
  const double disc = std::numbers::pi * reach_mm * reach_mm;
  double cumulative = 0;
  for (std::size_t ring = 0; ring < kRings; ++ring) {
    const double even = area(ring) / disc;
    const double share =
        sum > 0 ? (1 - kEvenShare) * mass[ring] / sum + kEvenShare * even : even;
    cumulative += share;
    cumulative_.push_back(static_cast<float>(cumulative));
    density_.push_back(static_cast<float>(share / area(ring)));
  }
  cumulative_.back() = 1;
}

std::size_t RadialDensity::RingOf(float r_mm) const {
  std::size_t ring = 0;
  if (r_mm >= edges_[1]) {
    const float place = (std::log(r_mm) - log_finest_) * per_log_;
    ring = std::min(kRings - 1, static_cast<std::size_t>(std::max(0.0F, place)) + 1);
  }
  // The logarithm may be off by a ring at an edge.
  while (ring > 0 && r_mm < edges_[ring]) {
    --ring;
  }
  while (ring + 1 < kRings && r_mm >= edges_[ring + 1]) {
    ++ring;
  }
  return ring;
}

float RadialDensity::Sample(float u) const {
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, u);
  const auto ring = static_cast<std::size_t>(found - cumulative_.begin());
  const float before = ring > 0 ? cumulative_[ring - 1] : 0;
  const float within = (u - before) / std::max(cumulative_[ring] - before, 1e-30F);
  const float inner = edges_[ring];
  const float outer = edges_[ring + 1];
  return std::sqrt(inner * inner +
                   std::clamp(within, 0.0F, 1.0F) * (outer - inner) * (outer + inner));
}

float RadialDensity::Pdf(float r_mm) const {
  return r_mm < reach_mm_ ? density_[RingOf(r_mm)] : 0;
}

}  // namespace nacre::render

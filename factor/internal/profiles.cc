#include "factor/internal/profiles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::factor::internal {
namespace {

// The profile of a grid point, or of the nearest one there is, at an offset.
double Profile(const Material& m,
               int channel,
               const std::vector<Gaussian>& gaussians,
               GridIndex point,
               GridIndex offset) {
  const int x = std::clamp(point.x + m.margin, 0, m.MapWidth() - 1);
  const int y = std::clamp(point.y + m.margin, 0, m.MapHeight() - 1);
  const std::int64_t at = std::int64_t{y} * m.MapWidth() + x;
  double sum = 0;
  for (int term = 0; term < m.terms; ++term) {
    sum += static_cast<double>(m.FactorMap(channel, term)[at]) *
           gaussians[static_cast<std::size_t>(term)].At(offset.x, offset.y);
  }
  return std::max(0.0, sum);
}

float Pair(const Material& m,
           int channel,
           const std::vector<Gaussian>& gaussians,
           GridIndex point,
           GridIndex cell) {
  const int radius = (m.core - 1) / 2;
  const GridIndex offset{cell.x - radius, cell.y - radius};
  const double from = Profile(m, channel, gaussians, point, offset);
  const double to =
      Profile(m, channel, gaussians, {point.x + offset.x, point.y + offset.y}, offset);
  return static_cast<float>(std::sqrt(from * to));
}

}  // namespace

Gaussian::Gaussian(double beta_per_mm2, int radius, double pitch_mm)
    : height_(beta_per_mm2 / (2 * std::numbers::pi)) {
  for (int k = 0; k <= radius; ++k) {
    along_.push_back(std::exp(-0.5 * beta_per_mm2 * std::pow(k * pitch_mm, 2)));
  }
}

std::vector<Gaussian> GaussiansOf(const Material& m, int channel) {
  std::vector<Gaussian> gaussians;
  for (int term = 0; term < m.terms; ++term) {
    const auto log_beta = static_cast<double>(m.Kernel(channel, 0, term)[0]);
    gaussians.emplace_back(std::exp(log_beta), (m.core - 1) / 2, m.pitch_mm);
  }
  return gaussians;
}

float ProfilesCell(const Material& m, int channel, GridIndex point, GridIndex cell) {
  return Pair(m, channel, GaussiansOf(m, channel), point, cell);
}

void ProfilesWindow(const Material& m, int channel, GridIndex point, float* window) {
  const std::vector<Gaussian> gaussians = GaussiansOf(m, channel);
  for (int v = 0; v < m.core; ++v) {
    for (int u = 0; u < m.core; ++u) {
      window[v * m.core + u] = Pair(m, channel, gaussians, point, {u, v});
    }
  }
}

}  // namespace nacre::factor::internal

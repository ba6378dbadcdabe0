#include "rigs/transport/beam_nodes.h"

#include "core/error.h"
#include "rigs/internal/gauss_legendre.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::rigs {
namespace {

// Gauss rules need about π nodes a wavelength; details are half a wavelength.
int OrderFor(double extent_mm, double feature_mm) {
  constexpr int kLeast = 6;
  constexpr int kMost = 24;
  return std::clamp(
      static_cast<int>(std::ceil(3 * extent_mm / feature_mm)), kLeast, kMost);
}

}  // namespace

std::vector<BeamNode> HalfRoundBeam(const Beam& beam, double feature_mm) {
  Expect(beam.shape == BeamShape::kDisc || beam.shape == BeamShape::kGaussian,
         "a round beam");
  const bool is_gaussian = beam.shape == BeamShape::kGaussian;
  constexpr double kFarthestSigma = 5;  // 4e-6 of the flux lies beyond
  const double sigma_mm = 0.25 * beam.width_mm;
  const double radius_mm =
      is_gaussian ? kFarthestSigma * sigma_mm : 0.5 * beam.width_mm;
  const double extent_mm = is_gaussian ? 2 * sigma_mm : radius_mm;
  const int angles = OrderFor(std::numbers::pi * extent_mm, feature_mm);
  const internal::GaussRule rule = internal::GaussLegendre(
      OrderFor(is_gaussian ? 2 * extent_mm : extent_mm, feature_mm) +
      (is_gaussian ? 6 : 0));
  std::vector<BeamNode> nodes;
  double sum = 0;
  for (std::size_t k = 0; k < rule.node.size(); ++k) {
    const double rho = 0.5 * radius_mm * (1 + rule.node[k]);
    const double shape =
        is_gaussian ? std::exp(-0.5 * rho * rho / (sigma_mm * sigma_mm)) : 1;
    for (int a = 0; a < angles; ++a) {
      const double angle = std::numbers::pi * (a + 0.5) / angles;
      const double weight = rule.weight[k] * rho * shape;
      nodes.push_back({{rho * std::cos(angle), rho * std::sin(angle)}, weight});
      sum += weight;
    }
  }
  for (BeamNode& node : nodes) {
    node.weight /= sum;
  }
  return nodes;
}

std::vector<BeamNode> SquareBeam(const Beam& beam, double feature_mm) {
  const internal::GaussRule rule =
      internal::GaussLegendre(OrderFor(beam.width_mm, feature_mm));
  std::vector<BeamNode> nodes;
  for (std::size_t b = 0; b < rule.node.size(); ++b) {
    for (std::size_t a = 0; a < rule.node.size(); ++a) {
      nodes.push_back(
          {{0.5 * beam.width_mm * rule.node[a], 0.5 * beam.width_mm * rule.node[b]},
           0.25 * rule.weight[a] * rule.weight[b]});
    }
  }
  return nodes;
}

}  // namespace nacre::rigs

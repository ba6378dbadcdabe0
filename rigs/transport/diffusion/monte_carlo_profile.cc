#include "rigs/transport/diffusion/monte_carlo_profile.h"

#include "core/error.h"
#include "rigs/internal/gauss_legendre.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <vector>

namespace nacre::rigs::diffusion {
namespace {

constexpr double kFinestFreePaths = 0.05;
constexpr int kMostRings = 20'000;
constexpr double kFewestPhotons = 2000;

// ∫ model 2πr dr over a ring; v² calms what the model does at r = 0.
double ModelFlux(const RobinSlab& model, double from_mm, double to_mm) {
  const rigs::internal::GaussRule rule = rigs::internal::GaussLegendre(8);
  double sum = 0;
  for (std::size_t k = 0; k < rule.node.size(); ++k) {
    const double v = 0.5 * (1 + rule.node[k]);
    const double r = from_mm + (to_mm - from_mm) * v * v;
    const double dr = (to_mm - from_mm) * 2 * v * 0.5 * rule.weight[k];
    sum += model.Reflectance(r) * 2 * std::numbers::pi * r * dr;
  }
  return sum;
}

// Where the logarithm of the ratio is known, ascending.
struct Node {
  double r_mm;
  double log_ratio;
};

double Interpolate(const std::vector<Node>& nodes, double r_mm) {
  const auto above = std::find_if(
      nodes.begin(), nodes.end(), [&](const Node& n) { return n.r_mm > r_mm; });
  if (above == nodes.begin()) {
    return nodes.front().log_ratio;
  }
  if (above == nodes.end()) {
    return nodes.back().log_ratio;
  }
  const Node& below = *(above - 1);
  return std::lerp(below.log_ratio,
                   above->log_ratio,
                   (r_mm - below.r_mm) / (above->r_mm - below.r_mm));
}

monte_carlo::Result Count(const Phantom& phantom,
                          const MonteCarloProfileRequest& request,
                          double ring_mm) {
  Phantom alone = phantom;
  alone.pattern = {};
  alone.media = {phantom.media[request.medium]};
  const int rings = static_cast<int>(std::ceil(request.last_mm / ring_mm));
  return monte_carlo::Simulate(
      monte_carlo::MakeVolume(alone, request.channel),
      monte_carlo::Source{},
      {.ring_count = std::min(rings, kMostRings), .ring_width_mm = ring_mm},
      {.photon_count = request.photon_count,
       .seed = request.seed,
       .thread_count = request.thread_count,
       .ranks = request.ranks});
}

}  // namespace

std::function<double(double r_mm)> MonteCarloProfile(
    const Phantom& phantom,
    const MonteCarloProfileRequest& request,
    const RobinSlab& model) {
  const Medium& medium = phantom.media[request.medium];
  const double sigma_a = medium.sigma_a_per_mm[request.channel];
  if (std::isinf(phantom.slab.thickness_mm) && !(sigma_a > 0)) {
    throw BadData(fmt::format(
        "the diffusion solver: medium '{}' doesn't absorb in channel {} and the slab "
        "is infinitely thick, so that Monte Carlo can't give its profile; use "
        "reference_photons = 0",
        medium.name,
        phantom.channels[request.channel]));
  }
  const double free_path_mm = 1 / (sigma_a + medium.ReducedScattering(request.channel));
  const double ring_mm = kFinestFreePaths * free_path_mm;
  const monte_carlo::Result result = Count(phantom, request, ring_mm);
  const double photons = static_cast<double>(result.photon_count);

  std::vector<Node> nodes;
  const auto count = static_cast<int>(result.ring_per_mm2.size());
  for (int first = 0; first < count;) {
    // Rings put together until they are a tenth of their radius wide, farther out,
    // where the ratio hardly changes, a quarter.
    const double from_mm = first * ring_mm;
    const double part = from_mm < 3 * free_path_mm ? 0.1 : 0.25;
    const int last =
        std::min(count, first + std::max(1, static_cast<int>(part * first)));
    double light = 0;
    for (int k = first; k < last; ++k) {
      const double area = std::numbers::pi * (2 * k + 1) * ring_mm * ring_mm;
      light += area * result.ring_per_mm2[static_cast<std::size_t>(k)].mean;
    }
    if (light * photons < kFewestPhotons) {
      break;
    }
    const double to_mm = last * ring_mm;
    nodes.push_back(
        {0.5 * (from_mm + to_mm), std::log(light / ModelFlux(model, from_mm, to_mm))});
    first = last;
  }
  if (nodes.empty()) {
    throw BadData(fmt::format(
        "the diffusion solver: {} photons give no profile of medium '{}' in channel "
        "{}; raise reference_photons, or set it to 0",
        result.photon_count,
        medium.name,
        phantom.channels[request.channel]));
  }
  return [model, nodes](double r_mm) {
    return model.Reflectance(r_mm) * std::exp(Interpolate(nodes, r_mm));
  };
}

}  // namespace nacre::rigs::diffusion

#include "rigs/transport/monte_carlo/monte_carlo_transport.h"

#include "core/error.h"
#include "core/random.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace nacre::rigs::monte_carlo {
namespace {

// A seed of its own for every beam: the seed, the channel and x_i, well mixed.
std::int64_t SeedOf(std::int64_t seed, std::size_t channel, PointMm x_i) {
  const auto key = static_cast<std::uint64_t>(seed);
  std::array<std::uint32_t, 4> block{0, 0, static_cast<std::uint32_t>(channel), 0};
  for (const double coordinate : {x_i.x, x_i.y}) {
    const auto bits = std::bit_cast<std::uint64_t>(coordinate);
    block[0] ^= static_cast<std::uint32_t>(bits);
    block[1] ^= static_cast<std::uint32_t>(bits >> 32);
    block = Philox(
        block,
        {static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)});
  }
  return static_cast<std::int64_t>((static_cast<std::uint64_t>(block[0] >> 1) << 32) |
                                   block[1]);
}

}  // namespace

MonteCarloTransport::MonteCarloTransport(const Phantom& phantom, const Options& options)
    : phantom_(phantom), options_(options) {
  nacre::Validate(options);
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    volumes_.push_back(MakeVolume(phantom, c));
    monte_carlo::Validate(volumes_.back());
  }
}

Result MonteCarloTransport::Simulate(PointMm x_i,
                                     std::size_t channel,
                                     const TallyRequest& request,
                                     const ProgressFunction& progress) const {
  Options options = options_;
  options.seed = SeedOf(options_.seed, channel, x_i);
  return monte_carlo::Simulate(
      volumes_[channel], MakeSource(phantom_.beam, x_i), request, options, progress);
}

Window MonteCarloTransport::WindowAround(PointMm x_i) const {
  Expect(phantom_.grid.points_x > 0, "a phantom with a grid");
  const TallyRequest request{.window_centre = x_i,
                             .window_core = phantom_.grid.core,
                             .window_pitch_mm = phantom_.grid.pitch_mm,
                             .use_symmetry = true};
  Window window;
  for (std::size_t c = 0; c < volumes_.size(); ++c) {
    for (const Estimate& cell : Simulate(x_i, c, request).window_per_mm2) {
      window.rd.push_back(static_cast<float>(cell.mean));
      window.sigma.push_back(static_cast<float>(cell.se));
    }
  }
  return window;
}

void MonteCarloTransport::AddExitance(PointMm x_i,
                                      std::size_t channel,
                                      double flux,
                                      const PointColumns& points,
                                      float* exitance) const {
  const double pitch_mm = phantom_.grid.pitch_mm;
  if (!(pitch_mm > 0)) {
    throw BadData(
        "Monte Carlo: exitance is counted in the cells of the phantom's [grid], which "
        "is missing; add one with the pitch_mm to resolve");
  }
  const auto cells_from_centre = [&](float coordinate_mm, double centre_mm) {
    return std::lround((static_cast<double>(coordinate_mm) - centre_mm) / pitch_mm);
  };
  long radius = 0;
  for (std::size_t k = 0; k < points.count; ++k) {
    radius = std::max({radius,
                       std::abs(cells_from_centre(points.x_mm[k], x_i.x)),
                       std::abs(cells_from_centre(points.y_mm[k], x_i.y))});
  }
  // Beyond reach there is nothing worth a table.
  radius = std::min(radius, std::lround(std::ceil(ReachMm(channel) / pitch_mm)));
  const TallyRequest request{.window_centre = x_i,
                             .window_core = static_cast<int>(2 * radius + 1),
                             .window_pitch_mm = pitch_mm,
                             .use_symmetry = true};
  const Result result = Simulate(x_i, channel, request);
  for (std::size_t k = 0; k < points.count; ++k) {
    const long u = radius + cells_from_centre(points.x_mm[k], x_i.x);
    const long v = radius - cells_from_centre(points.y_mm[k], x_i.y);
    if (u >= 0 && v >= 0 && u < request.window_core && v < request.window_core) {
      exitance[k] += static_cast<float>(
          flux *
          result.window_per_mm2[static_cast<std::size_t>(v * request.window_core + u)]
              .mean);
    }
  }
}

double MonteCarloTransport::FindReachMm(std::size_t channel) const {
  constexpr double kLossBeyondReach = 1e-4;
  constexpr int kRings = 100'000;
  const Volume& volume = volumes_[channel];
  double shortest_mm = std::numeric_limits<double>::infinity();
  for (const Optics& m : volume.media) {
    const double sigma = m.sigma_a_per_mm + m.sigma_s_per_mm * (1 - m.g);
    shortest_mm = sigma > 0 ? std::min(shortest_mm, 1 / sigma) : shortest_mm;
  }
  shortest_mm = std::isfinite(shortest_mm) ? shortest_mm : volume.DepthMm();
  const double cell_mm = phantom_.pattern.cell_mm;
  double reach_mm = 0;
  for (int k = 0; k < phantom_.pattern.MediumCount(); ++k) {
    const PointMm x_i{(0.5 + k) * cell_mm, 0.5 * cell_mm};  // the middle of a cell
    const TallyRequest request{
        .window_centre = x_i, .ring_count = kRings, .ring_width_mm = 0.1 * shortest_mm};
    Options options = options_;
    options.photon_count = 400'000;
    options.seed = SeedOf(options_.seed, channel, x_i);
    const Result r =
        monte_carlo::Simulate(volume, MakeSource(phantom_.beam, x_i), request, options);
    // Outwards, until the light beyond is little enough to leave out.
    double beyond = r.reflected.mean;
    const double width = request.ring_width_mm;
    int ring = 0;
    while (ring < kRings && beyond > kLossBeyondReach) {
      const double area = std::numbers::pi * (2.0 * ring + 1) * width * width;
      beyond -= r.ring_per_mm2[static_cast<std::size_t>(ring)].mean * area;
      ++ring;
    }
    reach_mm = std::max(reach_mm, ring * width);
  }
  return reach_mm;
}

double MonteCarloTransport::ReachMm(std::size_t channel) const {
  std::call_once(reach_found_, [this] {
    for (std::size_t c = 0; c < volumes_.size(); ++c) {
      reach_mm_.push_back(FindReachMm(c));
    }
  });
  return reach_mm_[channel];
}

Totals MonteCarloTransport::TotalsAt(PointMm x_i, std::size_t channel) const {
  const Result r = Simulate(x_i, channel, {});
  return {.reflected = r.reflected.mean,
          .transmitted = r.transmitted.mean,
          .absorbed = r.absorbed.mean + r.backing.mean};
}

}  // namespace nacre::rigs::monte_carlo

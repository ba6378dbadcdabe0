// Error of the diffusion solver against Monte Carlo on a chessboard, by distance:
//   bench_diffusion_against_monte_carlo PHANTOM.toml X_MM Y_MM [PHOTONS]
// once as it is, once with Monte Carlo profiles of the homogeneous media for the near
// field. Only the first channel.
#include "rigs/transport/analytic/robin_slab.h"
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <numbers>
#include <string>
#include <vector>

namespace nacre::rigs {
namespace {

constexpr int kRings = 120;
constexpr double kRingMm = 0.1;

RobinSlab ExactSlab(const Phantom& phantom, std::size_t medium) {
  const DiffusionMedium m{phantom.media[medium].sigma_a_per_mm[0],
                          phantom.media[medium].ReducedScattering(0)};
  const double a = BoundaryFactor(BoundaryLaw::kExact, phantom.slab.eta);
  return RobinSlab({.medium = m,
                    .diffusion_mm = DiffusionMm(DiffusionLaw::kGrosjean, m),
                    .thickness_mm = phantom.slab.thickness_mm,
                    .top_factor = a,
                    .bottom_factor = a});
}

// Monte Carlo over exact diffusion, ring by ring, averaged over wider rings where few
// photons come out; 1 beyond.
struct Correction {
  std::vector<double> ratio;
  RobinSlab slab;
  double At(double r_mm) const {
    const double u = std::clamp(r_mm / kRingMm - 0.5, 0.0, kRings - 1.001);
    const auto k = static_cast<std::size_t>(u);
    return std::lerp(ratio[k], ratio[k + 1], u - static_cast<double>(k)) *
           slab.Reflectance(r_mm);
  }
};

Correction Calibrate(const Phantom& phantom, std::size_t medium, std::int64_t photons) {
  Phantom alone = phantom;
  alone.pattern = {};
  alone.media = {phantom.media[medium]};
  const auto result = monte_carlo::Simulate(
      monte_carlo::MakeVolume(alone, 0),
      monte_carlo::Source{},
      {.window_centre = {}, .ring_count = kRings, .ring_width_mm = kRingMm},
      {.photon_count = photons, .seed = 5});
  Correction c{{}, ExactSlab(phantom, medium)};
  for (int k = 0; k < kRings; ++k) {
    const int spread = k / 12;  // rings on each side
    double light = 0;
    double expected = 0;
    for (int s = std::max(0, k - spread); s <= std::min(kRings - 1, k + spread); ++s) {
      const double area = 2 * s + 1;
      light += area * result.ring_per_mm2[static_cast<std::size_t>(s)].mean;
      for (int n = 0; n < 8; ++n) {  // mean over the ring
        const double r = kRingMm * (s + (n + 0.5) / 8);
        expected += c.slab.Reflectance(r) * 2 * r / kRingMm / 8;
      }
    }
    c.ratio.push_back(light / expected);
  }
  return c;
}

void Print(const char* name,
           const Phantom& phantom,
           const Window& window,
           const monte_carlo::Result& truth,
           double free_path_mm) {
  constexpr std::array kEdges = {0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0};
  std::printf("%s\n  free paths   cells   mean error   rms error   rms noise\n", name);
  const int core = phantom.grid.core;
  for (std::size_t e = 0; e + 1 < kEdges.size(); ++e) {
    double sum = 0;
    double squares = 0;
    double noise = 0;
    int count = 0;
    for (int k = 0; k < core * core; ++k) {
      const double r = phantom.grid.pitch_mm *
                       std::hypot(k % core - core / 2, k / core - core / 2) /
                       free_path_mm;
      const auto& cell = truth.window_per_mm2[static_cast<std::size_t>(k)];
      if (r < kEdges[e] || r >= kEdges[e + 1] || cell.mean <= 0) {
        continue;
      }
      const double error =
          static_cast<double>(window.rd[static_cast<std::size_t>(k)]) / cell.mean - 1;
      sum += error;
      squares += error * error;
      noise += cell.se * cell.se / (cell.mean * cell.mean);
      ++count;
    }
    if (count > 0) {
      std::printf("  %4.1f - %4.1f %7d %10.2f %% %9.2f %% %9.2f %%\n",
                  kEdges[e],
                  kEdges[e + 1],
                  count,
                  100 * sum / count,
                  100 * std::sqrt(squares / count),
                  100 * std::sqrt(noise / count));
    }
  }
}

void Run(const std::string& path, PointMm x_i, std::int64_t photons) {
  const Phantom phantom = ReadPhantom(path);
  const auto truth = monte_carlo::Simulate(monte_carlo::MakeVolume(phantom, 0),
                                           monte_carlo::Source{.centre = x_i},
                                           {.window_centre = x_i,
                                            .window_core = phantom.grid.core,
                                            .window_pitch_mm = phantom.grid.pitch_mm},
                                           {.photon_count = photons, .seed = 1});
  double free_path_mm = 0;
  for (const Medium& medium : phantom.media) {
    free_path_mm = std::max(
        free_path_mm, 1 / (medium.sigma_a_per_mm[0] + medium.ReducedScattering(0)));
  }
  std::printf("Monte Carlo: %lld photons, %.1f CPU-s; R %.5f\n",
              static_cast<long long>(photons),
              truth.cpu_seconds,
              truth.reflected.mean);
  const DiffusionTransport plain(phantom);
  const Totals totals = plain.TotalsAt(x_i, 0);
  std::printf(
      "diffusion: R %.5f, cut off %.5f\n", totals.reflected, plain.TruncatedAt(x_i, 0));
  Print("diffusion", phantom, plain.WindowAround(x_i), truth, free_path_mm);
  std::vector<Correction> corrections;
  for (std::size_t m = 0; m < phantom.media.size(); ++m) {
    corrections.push_back(Calibrate(phantom, m, photons));
  }
  const DiffusionTransport calibrated(
      phantom, {}, [&](std::size_t medium, std::size_t, double r_mm) {
        return corrections[medium].At(r_mm);
      });
  Print("with Monte Carlo near field",
        phantom,
        calibrated.WindowAround(x_i),
        truth,
        free_path_mm);
}

}  // namespace
}  // namespace nacre::rigs

int main(int argc, char** argv) {
  try {
    if (argc < 4) {
      std::fprintf(stderr, "usage: %s PHANTOM.toml X_MM Y_MM [PHOTONS]\n", argv[0]);
      return 2;
    }
    nacre::rigs::Run(argv[1],
                     {std::atof(argv[2]), std::atof(argv[3])},
                     argc > 4 ? std::atoll(argv[4]) : 1'000'000);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}

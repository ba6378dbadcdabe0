// Error of the diffusion solver against Monte Carlo on chessboards, by distance from
// the beam, with and without Monte Carlo profiles of the media as its reference:
//   diffusion_against_monte_carlo [PHOTONS [SEED [NAME]]]
// For five beams each: in the middle of either medium, on a border, on a corner, beside
// a border. Photons are independent of those of the profiles.
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fmt/format.h>
#include <string>
#include <vector>

namespace nacre::rigs {
namespace {

struct Optics {
  double sigma_a, sigma_s, g;
};

struct Board {
  const char* name;
  Optics first, second;
  double eta;
  double cell_mm;
  double pitch_mm;
  double thickness_mm = 10;
  const char* bottom = "air";
};

constexpr std::array kBoards = {
    Board{"marble-cream", {0.0021, 2.19, 0}, {0.01, 1.2, 0}, 1.5, 4, 0.4},
    Board{"marble-cream-n1", {0.0021, 2.19, 0}, {0.01, 1.2, 0}, 1.0, 4, 0.4},
    Board{"albedo", {0.002, 2.5, 0}, {0.02, 2.0, 0}, 1.3, 4, 0.4},
    Board{"forward", {0.0021, 10, 0.8}, {0.01, 4, 0.7}, 1.4, 6, 0.4},
    Board{"milks", {0.0011, 2.55, 0}, {0.0014, 0.70, 0}, 1.3, 6, 0.4},
    Board{"thin", {0.0021, 2.19, 0}, {0.01, 1.2, 0}, 1.5, 4, 0.4, 2, "matched"},
    Board{"thesis", {0.0021, 2.19, 0}, {0.06, 1.0, 0}, 1.5, 31.5, 0.455},
    Board{"fine-dark", {0.0021, 2.19, 0}, {0.05, 1.0, 0}, 1.5, 1.5, 0.25},
};

struct Place {
  const char* name;
  double x, y;  // in cells
};

constexpr int kCore = 39;
constexpr std::array kPlaces = {Place{"middle of 1st", 0.5, 0.5},
                                Place{"middle of 2nd", 1.5, 0.5},
                                Place{"border", 0, 0.5},
                                Place{"corner", 0, 0},
                                Place{"beside", 0.8, 0.45}};
constexpr std::array kEdges = {0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0};

Phantom Make(const Board& b) {
  const auto medium = [](const Optics& m) {
    return fmt::format(
        "[[medium]]\nsigma_a_per_mm = {}\nsigma_s_per_mm = {:f}\ng = {}\n",
        m.sigma_a,
        m.sigma_s,
        m.g);
  };
  return ParsePhantom(
      fmt::format("[slab]\nthickness_mm = {}\neta = {}\nbottom = \"{}\"\n{}{}"
                  "[pattern]\ntype = \"chessboard\"\ncell_mm = {}\n"
                  "[grid]\npoints = [64, 64]\npitch_mm = {}\ncore = {}\n",
                  b.thickness_mm,
                  b.eta,
                  b.bottom,
                  medium(b.first),
                  medium(b.second),
                  b.cell_mm,
                  b.pitch_mm,
                  kCore),
      b.name);
}

// A pencil on a border is half in each medium: beams on all sides of it are averaged.
std::vector<monte_carlo::Estimate> Truth(const Phantom& phantom,
                                         PointMm x_i,
                                         std::int64_t photons,
                                         std::int64_t seed) {
  const auto on_border = [&](double at) {
    return std::abs(at - phantom.pattern.cell_mm *
                             std::round(at / phantom.pattern.cell_mm)) < 1e-9;
  };
  std::vector<PointMm> beams{x_i};
  constexpr double kAside = 1e-4;
  if (on_border(x_i.x)) {
    beams = {{x_i.x - kAside, x_i.y}, {x_i.x + kAside, x_i.y}};
  }
  if (on_border(x_i.y)) {
    const std::vector<PointMm> before = beams;
    beams.clear();
    for (const PointMm& p : before) {
      beams.push_back({p.x, p.y - kAside});
      beams.push_back({p.x, p.y + kAside});
    }
  }
  const double share = 1.0 / static_cast<double>(beams.size());
  std::vector<monte_carlo::Estimate> sum(kCore * kCore);
  for (const PointMm& beam : beams) {
    const auto result = monte_carlo::Simulate(
        monte_carlo::MakeVolume(phantom, 0),
        monte_carlo::Source{.centre = beam},
        {.window_centre = x_i,
         .window_core = kCore,
         .window_pitch_mm = phantom.grid.pitch_mm,
         .use_symmetry = beams.size() == 1},
        {.photon_count = photons / static_cast<std::int64_t>(beams.size()),
         .seed = seed++});
    for (std::size_t k = 0; k < sum.size(); ++k) {
      sum[k].mean += share * result.window_per_mm2[k].mean;
      sum[k].se = std::hypot(sum[k].se, share * result.window_per_mm2[k].se);
    }
  }
  return sum;
}

struct Ring {
  int count = 0;
  double mean = 0;
  double squares = 0;  // of errors, less those of the noise
  double worst_noise = 0;
};

// Cells that Monte Carlo knows to 3 %.
std::array<Ring, kEdges.size() - 1> Compare(
    const Window& window,
    const std::vector<monte_carlo::Estimate>& truth,
    double pitch_in_free_paths) {
  std::array<Ring, kEdges.size() - 1> rings{};
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const int dx = static_cast<int>(k) % kCore - kCore / 2;
    const int dy = static_cast<int>(k) / kCore - kCore / 2;
    const double r = pitch_in_free_paths * std::hypot(dx, dy);
    const double noise = truth[k].se / truth[k].mean;
    if (r >= kEdges.back() || !(noise < 0.03)) {
      continue;
    }
    const auto above = std::upper_bound(kEdges.begin(), kEdges.end(), r);
    Ring& ring = rings[static_cast<std::size_t>(above - kEdges.begin()) - 1];
    const double error = static_cast<double>(window.rd[k]) / truth[k].mean - 1;
    ++ring.count;
    ring.mean += error;
    ring.squares += error * error - noise * noise;
    ring.worst_noise = std::max(ring.worst_noise, noise);
  }
  return rings;
}

void Print(const char* name, const std::array<Ring, kEdges.size() - 1>& rings) {
  std::printf("  %-22s", name);
  for (const Ring& ring : rings) {
    if (ring.count == 0) {
      std::printf("        -    ");
      continue;
    }
    std::printf(" %+6.1f /%4.1f",
                100 * ring.mean / ring.count,
                100 * std::sqrt(std::max(0.0, ring.squares / ring.count)));
  }
  std::printf("\n");
}

void Run(const Board& board, std::int64_t photons, std::int64_t seed) {
  const Phantom phantom = Make(board);
  double free_path_mm = 0;
  for (const Medium& medium : phantom.media) {
    free_path_mm = std::max(
        free_path_mm, 1 / (medium.sigma_a_per_mm[0] + medium.ReducedScattering(0)));
  }
  const DiffusionTransport hybrid(phantom);
  const DiffusionTransport pure(phantom, {.reference_photons = 0});
  std::printf("%s: the longer free path is %.3f mm; mean / rms error, %%, at\n  %-22s",
              board.name,
              free_path_mm,
              "free paths");
  for (std::size_t e = 0; e + 1 < kEdges.size(); ++e) {
    std::printf("  %4.1f - %4.1f ", kEdges[e], kEdges[e + 1]);
  }
  std::printf("\n");
  for (const Place& place : kPlaces) {
    const PointMm x_i{place.x * board.cell_mm, place.y * board.cell_mm};
    const auto truth = Truth(phantom, x_i, photons, seed);
    const double pitch = board.pitch_mm / free_path_mm;
    Print(place.name, Compare(hybrid.WindowAround(x_i), truth, pitch));
    Print("  diffusion alone", Compare(pure.WindowAround(x_i), truth, pitch));
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace nacre::rigs

int main(int argc, char** argv) {
  try {
    const std::int64_t photons = argc > 1 ? std::atoll(argv[1]) : 10'000'000;
    const std::int64_t seed = argc > 2 ? std::atoll(argv[2]) : 1000;
    for (const nacre::rigs::Board& board : nacre::rigs::kBoards) {
      if (argc <= 3 || std::string(argv[3]) == board.name) {
        nacre::rigs::Run(board, photons, seed);
      }
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}

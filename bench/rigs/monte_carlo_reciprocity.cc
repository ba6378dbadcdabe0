// What goes from one square of a chessboard to another against what comes back: with
// Lambertian light in and all light out, which is reciprocal, and at normal incidence,
// which isn't.
//   monte_carlo_reciprocity [photons]
#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fmt/format.h>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

constexpr double kSideMm = 0.5;

struct Pair {
  const char* name;
  PointMm a;
  PointMm b;
};

Volume Chessboard() {
  Volume volume;
  volume.media = {{0.0021, 2.19, 0}, {0.05, 1.0, 0}};
  volume.layers = {{10, 1.5, 0}};
  volume.pattern = {PatternType::kChessboard, 1.5};
  return volume;
}

Estimate Between(PointMm from, PointMm to, bool diffuse, const Options& options) {
  return Simulate(Chessboard(),
                  {.centre = from,
                   .shape = BeamShape::kSquare,
                   .width_mm = kSideMm,
                   .diffuse = diffuse},
                  {.window_centre = to, .window_core = 1, .window_pitch_mm = kSideMm},
                  options)
      .window_per_mm2[0];
}

void Run(std::int64_t photons) {
  const std::vector<Pair> pairs{
      {"marble, dark, 1 mm, across a border", {1.0, 0.75}, {2.0, 0.75}},
      {"marble, dark, centres, 1.5 mm", {0.75, 0.75}, {2.25, 0.75}},
      {"marble, dark, 3.35 mm", {0.75, 0.75}, {3.75, 2.25}},
      {"marble, marble, 2.12 mm", {0.75, 0.75}, {2.25, 2.25}},
      {"marble middle, marble edge, 0.5 mm", {0.75, 0.75}, {1.25, 0.75}}};
  Options options{.photon_count = photons};
  fmt::print("squares of {} mm, {} photons each way\n", kSideMm, photons);
  for (const Pair& pair : pairs) {
    for (const bool diffuse : {true, false}) {
      options.seed += 2;
      const Estimate there = Between(pair.a, pair.b, diffuse, options);
      ++options.seed;
      const Estimate back = Between(pair.b, pair.a, diffuse, options);
      const double ratio = back.mean / there.mean;
      const double se = ratio * std::hypot(there.se / there.mean, back.se / back.mean);
      fmt::print("| {} | {} | {:.5f} | {:.5f} | {:.4f} ± {:.4f} | {:+.1f} |\n",
                 pair.name,
                 diffuse ? "Lambertian" : "normal",
                 there.mean,
                 back.mean,
                 ratio,
                 se,
                 (ratio - 1) / se);
    }
  }
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

int main(int argc, char** argv) {
  nacre::rigs::monte_carlo::Run(argc > 1 ? std::atoll(argv[1]) : 2'000'000);
  return 0;
}

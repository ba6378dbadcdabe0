// Photons per CPU-second, and the figure of merit 1 / (variance × CPU-seconds) of one
// cell 2 mm from the beam, of the packets and of the scalar oracle's methods.
//   monte_carlo_speed [photons]         the best instruction set, half a minute
//   monte_carlo_speed --all [photons]   all of them, and the scalar oracle's methods
#include "rigs/transport/monte_carlo/scalar_oracle.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fmt/format.h>
#include <limits>
#include <string>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Case {
  std::string name;
  Volume volume;
  Source source;
};

std::vector<Case> Cases() {
  std::vector<Case> cases(4);
  cases[0].name = "half-space";
  cases[0].volume.media = {{0.01, 5, 0.8}};
  cases[0].volume.layers = {{kInfinity, 1.37, 0}};
  cases[1].name = "cube 60 mm";
  cases[1].volume.media = {{0.005, 1, 0.01}};
  cases[1].volume.layers = {{60, 1.37, 0}};
  cases[1].volume.box = Box{30, 30};
  cases[1].source.centre = {-1, -1};
  cases[2].name = "chessboard";
  cases[2].volume.media = {{0.0021, 2.19, 0}, {0.05, 1.0, 0}};
  cases[2].volume.layers = {{10, 1.5, 0}};
  cases[2].volume.pattern = {PatternType::kChessboard, 1.5};
  cases[2].source.centre = {0.75, 0.75};
  cases[3].name = "same, voxels";
  cases[3].volume = cases[2].volume;
  cases[3].volume.pattern = {};
  cases[3].source.centre = {0.75, 0.75};
  // 32 x 32 cells; photons that get past them meet the same media on other ground.
  VoxelGrid grid{.count = {192, 192, 1},
                 .size_mm = {0.25, 0.25, 10},
                 .left_mm = -24,
                 .lower_mm = -24,
                 .medium = {}};
  for (int j = 0; j < 192; ++j) {
    for (int i = 0; i < 192; ++i) {
      grid.medium.push_back(static_cast<std::uint16_t>((i / 6 + j / 6) % 2));
    }
  }
  cases[3].volume.voxels = grid;
  return cases;
}

void Print(const std::string& name, const std::string& method, const Result& r) {
  // Cell (27, 19) of 39: 2 mm to the right.
  const Estimate cell = r.window_per_mm2[19 * 39 + 27];
  fmt::print(
      "{:12} {:28} {:9.0f} photons/s  {:6.1f} steps/photon  {:6.1f} M steps/s  "
      "R {:.5f} ± {:.5f}  cell {:.3e} ± {:.0e} /mm²  merit of R {:.3g}, of the "
      "cell {:.3g}\n",
      name,
      method,
      static_cast<double>(r.photon_count) / r.cpu_seconds,
      static_cast<double>(r.step_count) / static_cast<double>(r.photon_count),
      1e-6 * static_cast<double>(r.step_count) / r.cpu_seconds,
      r.reflected.mean,
      r.reflected.se,
      cell.mean,
      cell.se,
      1 / (r.reflected.se * r.reflected.se * r.cpu_seconds),
      1 / (cell.se * cell.se * r.cpu_seconds));
}

void Run(const Case& c, std::int64_t photons, bool all) {
  const TallyRequest request{
      .window_centre = c.source.centre, .window_core = 39, .window_pitch_mm = 0.25};
  Options options{.photon_count = photons, .seed = 7, .thread_count = 1};
  std::vector<std::string> sets = InstructionSets();
  sets.resize(all ? sets.size() : 1);
  for (const std::string& set : sets) {
    UseInstructionSet(set);
    Print(c.name, "packets " + set, Simulate(c.volume, c.source, request, options));
  }
  UseInstructionSet("");
  if (!all) {
    return;
  }
  options.photon_count = std::max<std::int64_t>(1, photons / 40);
  for (const Capture capture : {Capture::kAnalog, Capture::kImplicit}) {
    for (const Tracking tracking : {Tracking::kExact, Tracking::kWoodcock}) {
      const std::string method =
          std::string(capture == Capture::kAnalog ? "scalar analog"
                                                  : "scalar implicit") +
          (tracking == Tracking::kExact ? ", exact" : ", Woodcock");
      Print(c.name,
            method,
            SimulateScalar(c.volume, c.source, request, options, {capture, tracking}));
    }
  }
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

int main(int argc, char** argv) {
  const bool all = argc > 1 && std::string(argv[1]) == "--all";
  const int at = all ? 2 : 1;
  const std::int64_t photons = argc > at ? std::atoll(argv[at]) : 4'000'000;
  for (const auto& c : nacre::rigs::monte_carlo::Cases()) {
    nacre::rigs::monte_carlo::Run(c, photons, all);
  }
  return 0;
}

// What a picture of the camera twin costs: 1024 × 1024 pixels of 36 spots, other spots
// in every picture, as a scan makes them. ms a picture, part by part, on one thread
// and on two.
//
//   bench_camera_twin_speed [PICTURES]

#include "rigs/camera_twin.h"
#include "rigs/laser_twin.h"
#include "rigs/phantom.h"
#include "rigs/transport/path_averaged.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

namespace {

using namespace nacre::rigs;

constexpr int kSidePx = 1024;
constexpr double kFieldMm = 172;
constexpr double kDistanceMm = 600;
constexpr int kSpotsAside = 6;
constexpr double kSpotSigmaMm = 0.12;

double CpuMs() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) +
         1e-6 * static_cast<double>(now.tv_nsec);
}

double WallMs() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

Phantom Marbles(PatternType type) {
  Phantom phantom;
  phantom.channels = {"R"};
  phantom.slab = {.thickness_mm = 10, .eta = 1.5, .bottom = Bottom::kAir};
  phantom.media = {{"white", {0.0021}, {2.19}, {0.0}}};
  if (type != PatternType::kHomogeneous) {
    phantom.media.push_back({"dark", {0.06}, {1.0}, {0.0}});
    phantom.pattern = {.type = type, .cell_mm = 31.5};
  }
  phantom.beam = {.shape = BeamShape::kGaussian, .width_mm = 4 * kSpotSigmaMm};
  return phantom;
}

CameraModel Model() {
  CameraModel model;
  model.geometry.width_px = kSidePx;
  model.geometry.height_px = kSidePx;
  model.geometry.focal_px = kSidePx * kDistanceMm / kFieldMm;
  model.geometry.centre_x_px = 0.5 * (kSidePx - 1);
  model.geometry.centre_y_px = 0.5 * (kSidePx - 1);
  model.geometry.lens = {.k1 = -0.12, .k2 = 0.02, .p1 = 4e-4, .p2 = -3e-4};
  model.geometry.camera_from_sample = LookAtOrigin(kDistanceMm, 0.21, -1.57);
  model.electrons_per_us_per_radiance = {6.5};
  model.spot_flux_mw = {10};
  model.spot_sigma_mm = kSpotSigmaMm;
  return model;
}

// A lattice of spots that wanders through its cell from picture to picture.
std::vector<Spot> SpotsOf(int picture) {
  constexpr double kSpacingMm = 25;
  std::vector<Spot> spots;
  const double shift = std::fmod(picture * 0.618, 1.0) - 0.5;
  for (int j = 0; j < kSpotsAside; ++j) {
    for (int i = 0; i < kSpotsAside; ++i) {
      spots.push_back(
          {{(i - 2.5 + 0.9 * shift) * kSpacingMm, (j - 2.5 - 0.7 * shift) * kSpacingMm},
           0.99});
    }
  }
  return spots;
}

void Measure(const char* name, const Phantom& phantom, int threads, int pictures) {
  auto world = std::make_shared<World>();
  world->target = nacre::acquire::Target::kSample;
  CameraTwin camera(
      Model(), std::make_shared<PathAveraged>(phantom, threads), world, threads);
  camera.SetExposureUs(12000);
  double cpu_of_rates = 0;
  double cpu = 0;
  double wall = 0;
  double least_cpu = 1e9;
  double least_wall = 1e9;
  std::uint64_t sum = 0;
  for (int k = -1; k < pictures; ++k) {
    world->spots = SpotsOf(k);
    ++world->revision;
    const double cpu_start = CpuMs();
    const double wall_start = WallMs();
    camera.Rates();
    const double cpu_after_rates = CpuMs();
    const auto frame =
        camera.Capture(static_cast<std::uint64_t>(k + 1), std::chrono::milliseconds(0));
    if (k >= 0) {  // the first one warms up
      cpu_of_rates += (cpu_after_rates - cpu_start) / pictures;
      cpu += (CpuMs() - cpu_start) / pictures;
      wall += (WallMs() - wall_start) / pictures;
      least_cpu = std::min(least_cpu, CpuMs() - cpu_start);
      least_wall = std::min(least_wall, WallMs() - wall_start);
    }
    sum += frame->counts[static_cast<std::size_t>(kSidePx) * kSidePx / 2 + 300];
  }
  std::printf(
      "%-12s %d thread%s  CPU %6.1f ms (light %5.1f, noise %5.1f), least %5.1f; wall "
      "%6.1f ms, least %5.1f  [%llu]\n",
      name,
      threads,
      threads == 1 ? " " : "s",
      cpu,
      cpu_of_rates,
      cpu - cpu_of_rates,
      least_cpu,
      wall,
      least_wall,
      static_cast<unsigned long long>(sum));
}

}  // namespace

int main(int argc, char** argv) {
  const int pictures = argc > 1 ? std::stoi(argv[1]) : 10;
  for (const int threads : {1, 2}) {
    Measure("homogeneous", Marbles(PatternType::kHomogeneous), threads, pictures);
    Measure("stripes", Marbles(PatternType::kStripes), threads, pictures);
    Measure("chessboard", Marbles(PatternType::kChessboard), threads, pictures);
  }
  return 0;
}

// Time of whole windows by the diffusion solver, and what a dataset would take:
//   diffusion_speed PHANTOM.toml [TILES [THREADS]]
// solves TILES neighbourhoods of 4 x 4 points spread over the grid; 0: all distinct
// points of the grid, which is a whole dataset.
#include "core/parallel.h"
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/diffusion/distinct_points.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <string>
#include <sys/resource.h>
#include <vector>

namespace nacre::rigs {
namespace {

double Now() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void Run(const std::string& path, int tile_count, int threads) {
  const Phantom phantom = ReadPhantom(path);
  DiffusionOptions options;
  options.thread_count = threads;
  double start = Now();
  const DiffusionTransport transport(phantom, options);
  std::printf("setup              %8.2f s\n", Now() - start);
  const auto distinct = diffusion::FindDistinctPoints(phantom.pattern, phantom.grid);
  std::printf("points             %8lld, distinct %zu\n",
              static_cast<long long>(phantom.grid.PointCount()),
              distinct.points.size());
  std::vector<PointMm> sample;
  if (tile_count == 0) {
    sample = distinct.points;
  }
  const std::size_t tiles = static_cast<std::size_t>(tile_count);
  const int per_side_x = phantom.grid.points_x / 4;
  const int per_side_y = phantom.grid.points_y / 4;
  for (std::size_t t = 0; t < tiles; ++t) {
    const int all = per_side_x * per_side_y;
    const int tile = static_cast<int>((t * 7919) % static_cast<std::size_t>(all));
    for (int k = 0; k < 16; ++k) {
      sample.push_back(phantom.grid.Point(
          4 * (tile % per_side_x) + k % 4,
          phantom.grid.points_y - 1 - 4 * (tile / per_side_x) - k / 4));
    }
  }
  start = Now();
  const std::clock_t cpu_start = std::clock();
  double sum = 0;
  transport.SolveWindows(sample, [&](std::size_t, Window&& window) {
    for (const float v : window.rd) {
      sum += static_cast<double>(v);
    }
  });
  const double seconds = Now() - start;
  const double cpu_seconds =
      static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  const double per_point = cpu_seconds / static_cast<double>(sample.size());
  std::printf("memory a thread    %8.1f MB\n",
              static_cast<double>(transport.MemoryBytes()) / 1e6);
  std::printf("%zu windows        %8.2f s on %d threads, %.2f CPU-s: %.2f ms each\n",
              sample.size(),
              seconds,
              ThreadCount(threads),
              cpu_seconds,
              1e3 * per_point);
  std::printf("all distinct ones  %8.1f CPU-s\n",
              per_point * static_cast<double>(distinct.points.size()));
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("most memory        %8.1f MB\n",
              static_cast<double>(usage.ru_maxrss) / 1e3);
  std::printf("checksum           %.9g\n", sum);
}

}  // namespace
}  // namespace nacre::rigs

int main(int argc, char** argv) {
  try {
    if (argc < 2) {
      std::fprintf(stderr, "usage: %s PHANTOM.toml [TILES [THREADS]]\n", argv[0]);
      return 2;
    }
    nacre::rigs::Run(
        argv[1], argc > 2 ? std::atoi(argv[2]) : 16, argc > 3 ? std::atoi(argv[3]) : 0);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}

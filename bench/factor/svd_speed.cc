// The truncated SVD of one channel in memory: time, bandwidth, and how much larger its
// error is than that of the exact one.
//   svd_speed [points_x] [points_y] [core] [terms] [repeats]
// 277 277 39 10 5 is the size of the published chessboard. The exact one comes from
// YᵀY in double and LAPACK's dsyevr; `--gesdd` as the last argument runs LAPACK's
// sgesdd, too (tens of seconds).

#include "core/parallel.h"
#include "factor/internal/block_svd.h"
#include "factor/internal/method.h"
#include "factor/internal/row_kernels.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fmt/format.h>
#include <numeric>
#include <string>
#include <vector>

#include "bench/factor/soft_chessboard.h"
#include "bench/factor/svd_oracle.h"

namespace {

using nacre::bench::Oracle;
using nacre::factor::internal::BlockSvds;
using nacre::factor::internal::RowTransform;
using nacre::reconstruct::RdDataset;

struct Clock {
  std::clock_t cpu = std::clock();
  std::chrono::steady_clock::time_point wall = std::chrono::steady_clock::now();
  double Cpu() const {
    return static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  }
  double Wall() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall)
        .count();
  }
};

struct Case {
  const char* name;
  RowTransform transform;
  double tolerance;
};

BlockSvds Solve(const RdDataset& data, const Case& c, int terms) {
  using namespace nacre::factor::internal;
  const auto source = SourceOf(data);
  const Sample sample = TakeSample(*source, kSvdSampleRows, 1);
  const auto sampled = SourceOf(sample.dataset);
  const std::int64_t window = data.header.WindowSize();
  const auto fill =
      [&](const SliceBlock& block, std::int64_t row, std::size_t, float* y) {
        const auto size = static_cast<std::size_t>(window);
        return TransformFloats(c.transform, {block.rd + row * window, size}, y);
      };
  BlockSvdSolver solver(fill, {0}, {.terms = terms, .tolerance = c.tolerance});
  return solver.Solve(*sampled, *source, {});
}

void ReadingAlone(const RdDataset& data) {
  const Clock clock;
  double total = 0;
  std::vector<double> sums(64);
  const auto part = static_cast<std::int64_t>(data.rd.size() / sums.size());
  nacre::ParallelFor(64, 0, [&](std::int64_t n) {
    // Sixteen sums, so that additions don't wait for each other.
    std::array<float, 16> lanes{};
    const float* from = &data.rd[static_cast<std::size_t>(n * part)];
    for (std::int64_t k = 0; k + 16 <= part; k += 16) {
      for (std::size_t lane = 0; lane < 16; ++lane) {
        lanes[lane] += from[k + static_cast<std::int64_t>(lane)];
      }
    }
    sums[static_cast<std::size_t>(n)] =
        std::accumulate(lanes.begin(), lanes.end(), 0.0);
  });
  total = std::accumulate(sums.begin(), sums.end(), 0.0);
  fmt::print("reading alone   {:.3f} CPU-s, {:.3f} s, {:.1f} GB/s (sum {:.6g})\n",
             clock.Cpu(),
             clock.Wall(),
             static_cast<double>(data.rd.size()) * 4e-9 / clock.Wall(),
             total);
}

void Run(const RdDataset& data, const Case& c, int terms, int repeats) {
  std::vector<double> cpu;
  std::vector<double> wall;
  BlockSvds found;
  for (int n = 0; n < repeats; ++n) {
    const Clock clock;
    found = Solve(data, c, terms);
    cpu.push_back(clock.Cpu());
    wall.push_back(clock.Wall());
  }
  std::sort(cpu.begin(), cpu.end());
  std::sort(wall.begin(), wall.end());
  const auto middle = static_cast<std::size_t>(repeats / 2);
  fmt::print(
      "{:6} to {:.0e}, S = {}: {:.3f} CPU-s ({:.3f} least), {:.3f} s wall, {} pass(es) "
      "over "
      "all rows, {:.2f} GB/s of matrix, estimated excess {:.1e}\n",
      c.name,
      c.tolerance,
      terms,
      cpu[middle],
      cpu.front(),
      wall[middle],
      found.passes,
      static_cast<double>(data.rd.size()) * 4e-9 / wall[middle],
      found.svds[0].excess);
  const Clock clock;
  const Oracle exact = nacre::bench::ExactSvd(data, c.transform, terms);
  const auto [excess, difference] =
      nacre::bench::Compare(data, c.transform, exact, found.svds[0]);
  fmt::print(
      "         relative error {:.5f}; over the exact SVD's by {:.2e} of it; "
      "reconstructions differ by {:.1e}; exact: {:.1f} CPU-s\n",
      exact.error,
      excess,
      difference,
      clock.Cpu());
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const auto argument = [&](int n, int otherwise) {
    return argc > n ? std::stoi(argv[n]) : otherwise;
  };
  const bool gesdd = argc > 1 && std::strcmp(argv[argc - 1], "--gesdd") == 0;
  if (gesdd) {
    --argc;
  }
  const int terms = argument(4, 10);
  const int repeats = argument(5, 5);
  const RdDataset data = nacre::bench::MakeSoftChessboard(
      argument(1, 277), argument(2, 277), argument(3, 39), 1);
  fmt::print("{} rows of {} floats, {:.0f} MB\n",
             data.header.PointCount(),
             data.header.WindowSize(),
             static_cast<double>(data.rd.size()) * 4e-6);
  const float peak = *std::max_element(data.rd.begin(), data.rd.end());
  ReadingAlone(data);
  const RowTransform log{true, 1e-2 * static_cast<double>(peak), 1};
  const RowTransform linear{false, static_cast<double>(peak), 1};
  for (const double tolerance : {1e-4, 1e-5}) {
    Run(data, {"log", log, tolerance}, terms, repeats);
    Run(data, {"linear", linear, tolerance}, terms, repeats);
  }
  if (gesdd) {
    const Clock clock;
    const double error = nacre::bench::LapackError(data, log, terms);
    fmt::print("LAPACK sgesdd, log: relative error {:.5f}, {:.1f} CPU-s\n",
               error,
               clock.Cpu());
  }
}

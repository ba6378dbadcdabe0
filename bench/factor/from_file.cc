// SVDs of all three channels from a file, beside reading that file alone.
//   from_file FILE.rd.exr [points] [core] [terms]
// makes the file where there is none: points × points slices of a soft chessboard.

#include "factor/factor.h"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fmt/format.h>
#include <string>

#include "bench/factor/soft_chessboard.h"

namespace {

using nacre::reconstruct::RdReader;

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

void Make(const std::filesystem::path& path, int points, int core) {
  nacre::reconstruct::RdDataset data =
      nacre::bench::MakeSoftChessboard(points, points, core, 3);
  data.sigma.assign(data.rd.size(), 3e-6F);
  nacre::reconstruct::WriteDataset(path, data);
}

void Run(const std::filesystem::path& path, int terms) {
  Clock clock;
  double sum = 0;
  RdReader reader(path);
  const nacre::reconstruct::RdHeader header = reader.header();
  for (int j = 0; j < header.points_y; ++j) {
    for (int i = 0; i < header.points_x; ++i) {
      sum += static_cast<double>(reader.ReadSlice(i, j).rd[0]);
    }
  }
  const double cpu = clock.Cpu();
  const double wall = clock.Wall();
  const double megabytes = 4e-6 * static_cast<double>(header.PointCount()) *
                           static_cast<double>(header.SliceSize());
  fmt::print(
      "{} x {} slices, core {}, {} channels: {:.0f} MB of floats, {:.0f} MB of "
      "file\nreading alone: {:.2f} CPU-s, {:.2f} s, {:.0f} MB/s (sum {:.6g})\n",
      header.points_x,
      header.points_y,
      header.core,
      header.channels.size(),
      megabytes,
      static_cast<double>(std::filesystem::file_size(path)) / 1e6,
      cpu,
      wall,
      megabytes / wall,
      sum);
  for (const char* method : {"svd", "log-svd"}) {
    clock = Clock();
    RdReader again(path);
    const auto summary =
        nacre::factor::Factor(again, {.method = method, .terms = terms}).summary;
    fmt::print(
        "{:8} S = {}: {:.2f} CPU-s, {:.2f} s: {:.0f} % of reading's speed by CPU "
        "time, {:.0f} % by the clock; {} reading(s) of all slices; relative L2 "
        "{:.5f} on {} slices\n",
        method,
        terms,
        clock.Cpu(),
        clock.Wall(),
        100 * cpu / clock.Cpu(),
        100 * wall / clock.Wall(),
        summary.passes,
        summary.relative_l2,
        summary.measured_slices);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    const auto argument = [&](int n, int otherwise) {
      return argc > n ? std::stoi(argv[n]) : otherwise;
    };
    if (argc < 2) {
      fmt::print(stderr, "from_file FILE.rd.exr [points] [core] [terms]\n");
      return 2;
    }
    if (!std::filesystem::exists(argv[1])) {
      Make(argv[1], argument(2, 139), argument(3, 39));
    }
    Run(argv[1], argument(4, 10));
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}

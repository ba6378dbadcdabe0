// Monte Carlo against totals by adding-doubling, per unit incident flux.
//   monte_carlo_adding_doubling TABLE.csv [photons] [seed]
// TABLE.csv has columns id, mu_a_per_mm, mu_s_per_mm, thickness_mm, g, n, R_total,
// T_total.
#include "core/error.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fmt/format.h>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> Split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    cells.push_back(cell);
  }
  return cells;
}

std::vector<Row> ReadTable(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) {
    throw BadData(path + ": can't be read, or is empty");
  }
  const std::vector<std::string> names = Split(line);
  std::vector<Row> rows;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = Split(line);
    Row row;
    for (std::size_t k = 0; k < std::min(names.size(), cells.size()); ++k) {
      row[names[k]] = cells[k];
    }
    rows.push_back(row);
  }
  return rows;
}

double Number(const Row& row, const std::string& name) {
  return std::strtod(row.at(name).c_str(), nullptr);
}

struct Deviations {
  double chi2 = 0;
  double worst = 0;
  int count = 0;

  double Add(const Estimate& estimate, double share, double expected) {
    const double z = (estimate.mean - expected) / (share * estimate.se);
    chi2 += z * z;
    worst = std::max(worst, std::abs(z));
    ++count;
    return z;
  }
};

void Run(const std::string& path, const Options& options) {
  Deviations deviations;
  double cpu_seconds = 0;
  for (const Row& row : ReadTable(path)) {
    Volume volume;
    volume.media = {
        {Number(row, "mu_a_per_mm"), Number(row, "mu_s_per_mm"), Number(row, "g")}};
    volume.layers = {{Number(row, "thickness_mm"), Number(row, "n"), 0}};
    const Result r = Simulate(volume, {}, {}, options);
    const double entered = 1 - r.specular;
    const Estimate reflected{r.specular + entered * r.reflected.mean, r.reflected.se};
    const Estimate transmitted{entered * r.transmitted.mean, r.transmitted.se};
    const double z_r = deviations.Add(reflected, entered, Number(row, "R_total"));
    fmt::print("{} R {:.6f} ± {:.6f} z {:+.2f}",
               row.at("id"),
               reflected.mean,
               entered * r.reflected.se,
               z_r);
    if (std::isfinite(volume.DepthMm())) {
      const double z_t = deviations.Add(transmitted, entered, Number(row, "T_total"));
      fmt::print("  T {:.6f} ± {:.6f} z {:+.2f}",
                 transmitted.mean,
                 entered * r.transmitted.se,
                 z_t);
    }
    cpu_seconds += r.cpu_seconds;
    fmt::print("  {:.1f} CPU-s\n", r.cpu_seconds);
  }
  fmt::print(
      "{} totals: chi²/n {:.3f}, worst |z| {:.2f}; {} photons a row, {:.0f} "
      "CPU-s\n",
      deviations.count,
      deviations.chi2 / deviations.count,
      deviations.worst,
      options.photon_count,
      cpu_seconds);
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: {} TABLE.csv [photons] [seed]\n", argv[0]);
    return 2;
  }
  nacre::rigs::monte_carlo::Options options;
  options.photon_count = argc > 2 ? std::atoll(argv[2]) : 8'000'000;
  options.seed = argc > 3 ? std::atoll(argv[3]) : 1;
  nacre::rigs::monte_carlo::Run(argv[1], options);
  return 0;
}

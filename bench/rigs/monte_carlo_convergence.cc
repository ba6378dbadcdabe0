// The error of T against adding-doubling over four decades of photons: its exponent,
// and its size against the binomial law.
//   monte_carlo_convergence [replicas]   400: seconds; 5000, for 1 % of noise: minutes
#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fmt/format.h>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

constexpr double kEntered = 1 - 0.020059;
constexpr double kTruth = 0.612666 / kEntered;  // albedo 0.2, τ 0.5, g 0.5, n 1.33

double RootMeanSquareError(const Volume& volume, std::int64_t photons, int replicas) {
  double sum = 0;
  for (int k = 0; k < replicas; ++k) {
    const Options options{.photon_count = photons, .seed = 5'000 + k};
    const double error = Simulate(volume, {}, {}, options).transmitted.mean - kTruth;
    sum += error * error;
  }
  return std::sqrt(sum / replicas);
}

void Run(int replicas) {
  Volume volume;
  volume.media = {{0.4, 0.1, 0.5}};
  volume.layers = {{1, 1.33, 0}};
  const std::vector<int> decades{2, 3, 4, 5, 6};
  double numerator = 0;
  for (const int decade : decades) {
    const auto photons = std::llround(std::pow(10.0, decade));
    const double error = RootMeanSquareError(volume, photons, replicas);
    const double law = std::sqrt(kTruth * (1 - kTruth) / static_cast<double>(photons));
    fmt::print("{:8} photons: error {:.3e}, over the binomial law {:.4f}\n",
               photons,
               error,
               error / law);
    numerator += (decade - 4) * std::log10(error);
  }
  fmt::print("exponent {:.4f} ± {:.4f}\n",
             numerator / 10,
             std::sqrt(0.5 / replicas / 10) / std::log(10.0));
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

int main(int argc, char** argv) {
  nacre::rigs::monte_carlo::Run(argc > 1 ? std::atoi(argv[1]) : 400);
  return 0;
}

// Monte Carlo against totals by adding-doubling, per unit incident flux: as many
// photons a row as make its standard errors small enough.
//   monte_carlo_adding_doubling [standard error] [seed]
// 2e-4 (the default): four minutes of one core. 2e-3: three seconds.
#include "rigs/transport/monte_carlo/monte_carlo.h"
#include "tests/rigs/transport/monte_carlo/reference_totals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fmt/format.h>

namespace nacre::rigs::monte_carlo {
namespace {

struct Deviations {
  double chi2 = 0;
  double worst = 0;
  int count = 0;

  double Add(double mean, double se, double expected) {
    const double z = (mean - expected) / se;
    chi2 += z * z;
    worst = std::max(worst, std::abs(z));
    ++count;
    return z;
  }
};

// p (1 − p) / N = (se / entered)², for the larger of R's and T's; a little more, since
// p is what is measured.
std::int64_t PhotonsFor(const ReferenceTotals& row, double entered, double se) {
  const auto variance = [](double p) { return p * (1 - p); };
  const double specular = 1 - entered;
  const double worst = std::max(variance((row.reflected - specular) / entered),
                                variance(row.transmitted / entered));
  return static_cast<std::int64_t>(
      std::ceil(1.01 * worst * entered * entered / (se * se)));
}

void Run(double wanted_se, std::int64_t seed) {
  Deviations deviations;
  double cpu_seconds = 0;
  for (const ReferenceTotals& row : kReferenceTotals) {
    Volume volume;
    volume.media = {{row.sigma_a_per_mm, row.sigma_s_per_mm, row.g}};
    volume.layers = {{row.thickness_mm, row.eta, 0}};
    const double entered = 1 - SpecularReflectance({}, volume);
    const Result r =
        Simulate(volume,
                 {},
                 {},
                 {.photon_count = PhotonsFor(row, entered, wanted_se), .seed = seed++});
    const double reflected = r.specular + entered * r.reflected.mean;
    const double r_se = entered * r.reflected.se;
    fmt::print("{} {:9} photons  R {:.6f} ± {:.6f}, reference {:.6f}, z {:+.2f}",
               row.id,
               r.photon_count,
               reflected,
               r_se,
               row.reflected,
               deviations.Add(reflected, r_se, row.reflected));
    if (std::isfinite(row.thickness_mm)) {
      const double transmitted = entered * r.transmitted.mean;
      const double t_se = entered * r.transmitted.se;
      fmt::print("  T {:.6f} ± {:.6f}, reference {:.6f}, z {:+.2f}",
                 transmitted,
                 t_se,
                 row.transmitted,
                 deviations.Add(transmitted, t_se, row.transmitted));
    }
    cpu_seconds += r.cpu_seconds;
    fmt::print("  {:.1f} CPU-s\n", r.cpu_seconds);
  }
  fmt::print("{} totals: chi²/n {:.3f}, worst |z| {:.2f}; {:.0f} CPU-s\n",
             deviations.count,
             deviations.chi2 / deviations.count,
             deviations.worst,
             cpu_seconds);
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

int main(int argc, char** argv) {
  nacre::rigs::monte_carlo::Run(argc > 1 ? std::atof(argv[1]) : 2e-4,
                                argc > 2 ? std::atoll(argv[2]) : 1);
  return 0;
}

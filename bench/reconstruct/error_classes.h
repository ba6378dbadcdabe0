#pragma once

#include <array>
#include <cmath>
#include <cstdio>

namespace nacre::reconstruct {

// What --values writes.
struct Value {
  float channel, i, j, u, v;
  float truth, rd, sigma;
  float bound;         // of the photons
  float sensor_bound;  // and of the sensor
  float plain;         // of the cell's photons, without blur
  float glare;         // of what is seen there
};

struct Decade {
  double count = 0;
  double per_bound2 = 0;
  double per_sensor2 = 0;
  double per_plain2 = 0;
  double per_sigma2 = 0;
  double within = 0;
  double error = 0;
  double truth = 0;
  double error2 = 0;

  void Add(const Value& value) {
    const auto off = static_cast<double>(value.rd - value.truth);
    const auto in = [&](float unit) {
      return std::pow(off / static_cast<double>(unit), 2);
    };
    count += 1;
    per_bound2 += in(value.bound);
    per_sensor2 += in(value.sensor_bound);
    per_plain2 += in(value.plain);
    per_sigma2 += in(value.sigma);
    within += std::abs(off) <= static_cast<double>(value.sigma) ? 1.0 : 0.0;
    error += off;
    truth += static_cast<double>(value.truth);
    error2 += off * off;
  }
};

struct Figures {
  std::array<Decade, 6> decades;  // of R_d / peak: down to 0.1, 0.01, …; and all
  double aside_mm = 0;            // points lit from grid points, rms
  double total_bias = 0;
  double total_rms = 0;
  double total_worst = 0;
  double totals = 0;
};

inline void Print(const Figures& figures) {
  constexpr std::array<const char*, 6> kNames = {
      "1 to 0.1", "0.1 to 0.01", "to 1e-3", "to 1e-4", "below", "all"};
  for (std::size_t n = 0; n < kNames.size(); ++n) {
    const Decade& d = figures.decades[n];
    if (d.count > 0) {
      std::printf(
          "  %-12s %7.0f values: error/bound %6.2f (sensor %6.2f, no blur %6.2f)  "
          "error/sigma "
          "%5.2f  within 1 sigma %4.1f %%  bias %+.3f %%  rms/mean %.3f %%\n",
          kNames[n],
          d.count,
          std::sqrt(d.per_bound2 / d.count),
          std::sqrt(d.per_sensor2 / d.count),
          std::sqrt(d.per_plain2 / d.count),
          std::sqrt(d.per_sigma2 / d.count),
          100 * d.within / d.count,
          100 * d.error / d.truth,
          100 * std::sqrt(d.error2 / d.count) / (d.truth / d.count));
    }
  }
  std::printf("  points lit %.4f mm rms from grid points\n", figures.aside_mm);
  std::printf("  totals: bias %+.3f %%, rms %.3f %%, worst %.3f %%\n",
              100 * figures.total_bias / figures.totals,
              100 * std::sqrt(figures.total_rms / figures.totals),
              100 * figures.total_worst);
}

}  // namespace nacre::reconstruct

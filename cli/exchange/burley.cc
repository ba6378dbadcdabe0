#include "cli/exchange/burley.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numbers>

namespace nacre::exchange {
namespace {

double Density(double r, double d) {
  return (std::exp(-r / d) + std::exp(-r / (3 * d))) / (8 * std::numbers::pi * d * r);
}

// The cell around r = 0, where the density is infinite: in polar coordinates its share
// is the mean of the share within the border's distance.
double CentreShare(double pitch, double d) {
  constexpr int kSteps = 64;
  double sum = 0;
  for (int n = 0; n < kSteps; ++n) {
    const double angle = (n + 0.5) / kSteps * std::numbers::pi / 4;
    sum += BurleyShare(0.5 * pitch / std::cos(angle) / d);
  }
  return sum / kSteps;
}

double CellShare(double x, double y, double pitch, double d) {
  // Near cells see the profile bend.
  const int n = std::hypot(x, y) < 4 * pitch ? 16 : 4;
  double sum = 0;
  for (int b = 0; b < n; ++b) {
    for (int a = 0; a < n; ++a) {
      sum += Density(std::hypot(x + ((a + 0.5) / n - 0.5) * pitch,
                                y + ((b + 0.5) / n - 0.5) * pitch),
                     d);
    }
  }
  return sum * pitch * pitch / (n * n);
}

}  // namespace

double BurleyShare(double x) {
  return -0.25 * std::expm1(-x) - 0.75 * std::expm1(-x / 3);
}

double BurleyScaling(double albedo) {
  const double off = albedo - 0.8;
  return 1.9 - albedo + 3.5 * off * off;
}

std::vector<double> BurleyWindow(int core, double pitch, double d) {
  const int radius = (core - 1) / 2;
  std::vector<double> window(static_cast<std::size_t>(core) *
                             static_cast<std::size_t>(core));
  const auto at = [&](int u, int v) -> double& {
    return window[static_cast<std::size_t>(std::int64_t{v + radius} * core + u +
                                           radius)];
  };
  // One octant; the others are its images.
  for (int v = 0; v <= radius; ++v) {
    for (int u = v; u <= radius; ++u) {
      const double share =
          u == 0 ? CentreShare(pitch, d) : CellShare(u * pitch, v * pitch, pitch, d);
      for (const int a : {u, -u}) {
        for (const int b : {v, -v}) {
          at(a, b) = share;
          at(b, a) = share;
        }
      }
    }
  }
  return window;
}

double SingleScatteringAlbedo(double albedo) {
  const double a = std::clamp(albedo, 0.0, 1.0);
  return -std::expm1(a * (-5.09406 + a * (2.61188 - 4.31805 * a)));
}

}  // namespace nacre::exchange

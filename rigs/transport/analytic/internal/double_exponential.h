#pragma once

#include <cmath>
#include <numbers>

namespace nacre::rigs::internal {

/// ∫₀^∞ f(u) du by the double exponential rule u = scale · exp(π/2 sinh t)
/// [Takahasi74]: about 12 digits for functions that are smooth on (0, ∞), whatever they
/// do at the ends, and whose features lie within a few decades of `scale`.
template <class Function>
double IntegrateToInfinity(double scale, Function&& f) {
  constexpr double kStep = 1.0 / 64;
  constexpr int kSteps = 230;  // u/scale from 1e-12 to 1e12
  double sum = 0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const double t = i * kStep;
    const double ratio = std::exp(0.5 * std::numbers::pi * std::sinh(t));
    const double u = scale * ratio;
    sum += f(u) * u * 0.5 * std::numbers::pi * std::cosh(t);
  }
  return sum * kStep;
}

}  // namespace nacre::rigs::internal

#pragma once

#include <cmath>
#include <numbers>

namespace nacre::rigs::testing {

/// ∫ f(r) 2πr dr, r from 10⁻⁵ to 400, on a geometric grid of Simpson panels.
template <class Function>
double OverPlane(Function&& f) {
  constexpr int kPanels = 400;
  const double low = std::log(1e-5);
  const double step = (std::log(400.0) - low) / kPanels;
  double sum = 0;
  for (int i = 0; i <= 2 * kPanels; ++i) {
    const double r = std::exp(low + 0.5 * step * i);
    const double weight = i == 0 || i == 2 * kPanels ? 1 : (i % 2 == 1 ? 4 : 2);
    sum += weight * f(r) * 2 * std::numbers::pi * r * r;
  }
  return sum * step / 6;
}

}  // namespace nacre::rigs::testing

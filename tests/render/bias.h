#pragma once

#include "core/exr.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {

/// How far two ways to the same picture differ beyond their noise, all over that
/// picture's root of summed squares.
struct Difference {
  double total = 0;  ///< between the means of their two pictures each, noise included
  double noise = 0;  ///< what independent pictures of this noise would differ by
  double bias = 0;   ///< what is left; 0 if noise explains everything
  double bound = 0;  ///< of the bias, at two standard errors
};

/// From two pictures of each way, all four of different seeds: with D1 = a1 − b1 and
/// D2 = a2 − b2, whose noises are independent, the mean of D1 D2 is the squared bias.
inline Difference Compare(const ExrPart& a1,
                          const ExrPart& a2,
                          const ExrPart& b1,
                          const ExrPart& b2) {
  double sum2 = 0;
  double total2 = 0;
  double noise2 = 0;
  double product = 0;
  double product2 = 0;
  for (std::size_t i = 0; i < a1.values.size(); ++i) {
    const auto at = [i](const ExrPart& part) {
      return static_cast<double>(part.values[i]);
    };
    const double mean_b = 0.5 * (at(b1) + at(b2));
    const double difference = 0.5 * (at(a1) + at(a2)) - mean_b;
    const double own_a = 0.5 * (at(a1) - at(a2));
    const double own_b = 0.5 * (at(b1) - at(b2));
    const double p = (at(a1) - at(b1)) * (at(a2) - at(b2));
    sum2 += mean_b * mean_b;
    total2 += difference * difference;
    noise2 += own_a * own_a + own_b * own_b;
    product += p;
    product2 += p * p;
  }
  const double error = 2 * std::sqrt(product2);
  return {.total = std::sqrt(total2 / sum2),
          .noise = std::sqrt(noise2 / sum2),
          .bias = std::sqrt(std::max(0.0, product) / sum2),
          .bound = std::sqrt((std::max(0.0, product) + error) / sum2)};
}

}  // namespace nacre::render

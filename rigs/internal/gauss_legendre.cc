#include "rigs/internal/gauss_legendre.h"

#include "core/error.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace nacre::rigs::internal {

GaussRule GaussLegendre(int order) {
  Expect(order >= 1, "an order of 1 or more");
  GaussRule rule;
  const auto count = static_cast<std::size_t>(order);
  rule.node.resize(count);
  rule.weight.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    // Newton's method on P_n from the usual first guess; four steps are plenty.
    double x =
        -std::cos(std::numbers::pi * (static_cast<double>(k) + 0.75) / (order + 0.5));
    double slope = 1;
    for (int step = 0; step < 6; ++step) {
      double before = 1;
      double p = x;
      for (int n = 2; n <= order; ++n) {
        const double next = ((2 * n - 1) * x * p - (n - 1) * before) / n;
        before = p;
        p = next;
      }
      slope = order * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    rule.node[k] = x;
    rule.weight[k] = 2 / ((1 - x * x) * slope * slope);
  }
  return rule;
}

}  // namespace nacre::rigs::internal

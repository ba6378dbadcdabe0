#pragma once

#include <vector>

namespace nacre::rigs::internal {

/// Nodes in (−1, 1), ascending, and their weights, 2 in sum.
struct GaussRule {
  std::vector<double> node;
  std::vector<double> weight;
};

/// Gauss–Legendre quadrature of any order ≥ 1, to rounding.
GaussRule GaussLegendre(int order);

}  // namespace nacre::rigs::internal

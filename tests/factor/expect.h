#pragma once

#include "factor/material.h"

#include <vector>

namespace nacre::testing {

/// As many numbers, each within `bound` of the other's.
void ExpectNear(const std::vector<float>& a, const std::vector<float>& b, double bound);

/// R_d(x_i → x_o) = R_d(x_o → x_i) to the last bit for every pair of points of the
/// grid, never negative, and the same asked for alone or by window.
void ExpectReciprocal(const factor::Material& m);

}  // namespace nacre::testing

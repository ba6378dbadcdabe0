#pragma once

#include <cmath>

namespace nacre::factor::internal {

/// The map between R_d and the numbers that are factored, a channel at a time:
/// s = ln(R/A + B) [Kurt14; Oenel14, eq. 4.4], or s = R/A for the linear model, or the
/// root of that, with R's sign, which evens out photons' noise. The logarithm is
/// written with log1p and expm1 around R = 0, s = ln B + log1p(R / AB), since R/A is
/// down to 1e-8 in the tails and ln(R/A + B) would keep nothing of it.
struct RowTransform {
  bool is_log = false;
  double a = 1;  ///< A, mm⁻², > 0
  double b = 1;  ///< B > 0
  bool is_root = false;

  double Forward(double rd) const {
    if (is_log) {
      return std::log(b) + std::log1p(rd / (a * b));
    }
    return is_root ? std::copysign(std::sqrt(std::abs(rd) / a), rd) : rd / a;
  }
  double Inverse(double s) const {
    if (is_log) {
      return a * b * std::expm1(s - std::log(b));
    }
    return is_root ? a * s * std::abs(s) : a * s;
  }
};

}  // namespace nacre::factor::internal

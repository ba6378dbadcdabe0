#pragma once

#include "acquire/illuminator.h"
#include "core/json_fwd.h"
#include "core/point_mm.h"

#include <array>
#include <string>

namespace nacre::acquire {

/// A cubic polynomial of two variables; the coefficients belong to the monomials
/// 1, u, v, u², uv, v², u³, u²v, uv², v³.
using Cubic = std::array<double, 10>;

/// The values of those monomials.
Cubic CubicMonomials(double u, double v);

/// Where the scanner's beam meets the sample plane, both ways. The two directions are
/// fitted separately, each to the same observations. Inputs are divided by
/// `half_width_mm` or `half_width_rad` before the polynomials are evaluated.
struct ScanMap {
  double half_width_mm = 1;
  double half_width_rad = 1;
  Cubic x_rad{};  ///< of sample position / half_width_mm
  Cubic y_rad{};
  Cubic x_mm{};  ///< of scan angle / half_width_rad
  Cubic y_mm{};

  ScanAngle AngleFromSample(PointMm point) const;
  PointMm SampleFromAngle(ScanAngle angle) const;
  friend bool operator==(const ScanMap&, const ScanMap&) = default;
};

Json ToJson(const ScanMap& map);

/// Throws BadData naming `origin` and the field.
ScanMap ScanMapFromJson(const Json& json, const std::string& origin);

}  // namespace nacre::acquire

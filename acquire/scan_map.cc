#include "acquire/scan_map.h"

#include "core/error.h"
#include "core/json.h"

#include <cmath>

namespace nacre::acquire {
namespace {

double Evaluate(const Cubic& coefficients, const Cubic& monomials) {
  double sum = 0;
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    sum += coefficients[k] * monomials[k];
  }
  return sum;
}

}  // namespace

Cubic CubicMonomials(double u, double v) {
  return {1, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v};
}

ScanAngle ScanMap::AngleFromSample(PointMm point) const {
  const Cubic monomials =
      CubicMonomials(point.x / half_width_mm, point.y / half_width_mm);
  return {Evaluate(x_rad, monomials), Evaluate(y_rad, monomials)};
}

PointMm ScanMap::SampleFromAngle(ScanAngle angle) const {
  const Cubic monomials =
      CubicMonomials(angle.x_rad / half_width_rad, angle.y_rad / half_width_rad);
  return {Evaluate(x_mm, monomials), Evaluate(y_mm, monomials)};
}

Json ToJson(const ScanMap& map) {
  return Json{{"half_width_mm", map.half_width_mm},
              {"half_width_rad", map.half_width_rad},
              {"x_rad", map.x_rad},
              {"y_rad", map.y_rad},
              {"x_mm", map.x_mm},
              {"y_mm", map.y_mm}};
}

ScanMap ScanMapFromJson(const Json& json, const std::string& origin) {
  ScanMap map;
  const auto positive = [&](const char* key) {
    const auto value = Get<double>(json, key, origin);
    if (!(value > 0 && std::isfinite(value))) {
      throw BadData(origin + ": field '" + key + "' must be positive and finite");
    }
    return value;
  };
  const auto cubic = [&](const char* key) {
    const auto values = Get<std::vector<double>>(json, key, origin);
    Cubic coefficients{};
    if (values.size() != coefficients.size()) {
      throw BadData(origin + ": field '" + key + "' must hold ten numbers");
    }
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (!std::isfinite(values[k])) {
        throw BadData(origin + ": field '" + key +
                      "' holds a number that isn't finite");
      }
      coefficients[k] = values[k];
    }
    return coefficients;
  };
  map.half_width_mm = positive("half_width_mm");
  map.half_width_rad = positive("half_width_rad");
  map.x_rad = cubic("x_rad");
  map.y_rad = cubic("y_rad");
  map.x_mm = cubic("x_mm");
  map.y_mm = cubic("y_mm");
  return map;
}

}  // namespace nacre::acquire

#include "calibrate/corrections.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>

namespace nacre::calibrate {

double SmoothField::At(double u, double v) const {
  if (coefficients.empty()) {
    return value_if_empty;
  }
  // Term by term along the diagonals of degree d: u^(d−k) v^k.
  double sum = 0;
  std::size_t k = 0;
  for (int d = 0; d <= degree; ++d) {
    for (int j = 0; j <= d; ++j, ++k) {
      sum += coefficients[k] * std::pow(u, d - j) * std::pow(v, j);
    }
  }
  return sum;
}

std::vector<float> SmoothField::Map(int width_px, int height_px) const {
  std::vector<float> map;
  map.reserve(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  const auto side = static_cast<std::size_t>(degree) + 1;
  for (int y = 0; y < height_px; ++y) {
    const double v = 2 * (y + 0.5) / height_px - 1;
    // The polynomial in u that is left along a row.
    std::vector<double> row(side, 0.0);
    std::size_t k = 0;
    for (std::size_t d = 0; d < side && !coefficients.empty(); ++d) {
      double power = 1;
      for (std::size_t j = 0; j <= d; ++j, ++k) {
        row[d - j] += coefficients[k] * power;
        power *= v;
      }
    }
    if (coefficients.empty()) {
      row[0] = value_if_empty;
    }
    for (int x = 0; x < width_px; ++x) {
      const double u = 2 * (x + 0.5) / width_px - 1;
      double value = 0;
      for (std::size_t d = side; d-- > 0;) {
        value = value * u + row[d];
      }
      map.push_back(static_cast<float>(value));
    }
  }
  return map;
}

double Glare::DensityAt(double distance_px) const {
  if (radius_px.empty()) {
    return 0;
  }
  if (distance_px < radius_px.front()) {
    return density_per_px2.front();
  }
  const auto above = std::upper_bound(radius_px.begin(), radius_px.end(), distance_px) -
                     radius_px.begin();
  const auto last = std::ssize(radius_px) - 1;
  if (last == 0) {
    return density_per_px2[0];
  }
  const auto b = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(above, 1, last));
  const std::size_t a = b - 1;
  // A density may be zero, of which there is no logarithm.
  constexpr double kLeast = 1e-300;
  const double low = std::log(std::max(density_per_px2[a], kLeast));
  const double high = std::log(std::max(density_per_px2[b], kLeast));
  const double part =
      std::log(distance_px / radius_px[a]) / std::log(radius_px[b] / radius_px[a]);
  return std::exp(low + part * (high - low));
}

}  // namespace nacre::calibrate

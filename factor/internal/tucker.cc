#include "factor/internal/tucker.h"

#include <algorithm>
#include <vector>

namespace nacre::factor::internal {
namespace {

// Σ_p a_cp I^p, by Horner's rule.
float Polynomial(const Material& m, int channel, std::int64_t point, double intensity) {
  double value = 0;
  for (int power = m.order; power >= 0; --power) {
    const float* map = m.FactorMap(0, TuckerCoefficientMap(m, channel, power));
    value = value * intensity + static_cast<double>(map[point]);
  }
  return static_cast<float>(std::max(0.0, value));
}

}  // namespace

std::int64_t TuckerShift(const Material& m, std::int64_t point) {
  return static_cast<std::int64_t>(m.FactorMap(0, TuckerShiftMap(m))[point]);
}

std::int64_t ShiftedCell(int core, std::int64_t shift, std::int64_t cell) {
  const std::int64_t u = (cell % core + core - shift % core) % core;
  const std::int64_t v = (cell / core + core - shift / core) % core;
  return v * core + u;
}

float TuckerCell(const Material& m, int channel, GridIndex point, GridIndex cell) {
  const std::int64_t at = std::int64_t{point.y} * m.points_x + point.x;
  const std::int64_t place =
      ShiftedCell(m.core, TuckerShift(m, at), std::int64_t{cell.y} * m.core + cell.x);
  double intensity = 0;
  for (int term = 0; term < m.terms; ++term) {
    intensity += static_cast<double>(m.FactorMap(0, term)[at]) *
                 static_cast<double>(m.Kernel(0, 0, term)[place]);
  }
  return Polynomial(m, channel, at, intensity);
}

void TuckerIntensity(const Material& m, GridIndex point, double* intensity) {
  const std::int64_t at = std::int64_t{point.y} * m.points_x + point.x;
  const std::int64_t shift = TuckerShift(m, at);
  std::vector<double> shifted(static_cast<std::size_t>(m.WindowSize()), 0.0);
  for (int term = 0; term < m.terms; ++term) {
    const auto weight = static_cast<double>(m.FactorMap(0, term)[at]);
    const float* kernel = m.Kernel(0, 0, term);
    for (std::size_t place = 0; place < shifted.size(); ++place) {
      shifted[place] += weight * static_cast<double>(kernel[place]);
    }
  }
  for (std::int64_t cell = 0; cell < m.WindowSize(); ++cell) {
    intensity[cell] =
        shifted[static_cast<std::size_t>(ShiftedCell(m.core, shift, cell))];
  }
}

void TuckerWindow(const Material& m, int channel, GridIndex point, float* window) {
  std::vector<double> intensity(static_cast<std::size_t>(m.WindowSize()));
  TuckerIntensity(m, point, intensity.data());
  const std::int64_t at = std::int64_t{point.y} * m.points_x + point.x;
  for (std::size_t cell = 0; cell < intensity.size(); ++cell) {
    window[cell] = Polynomial(m, channel, at, intensity[cell]);
  }
}

}  // namespace nacre::factor::internal

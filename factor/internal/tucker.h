#pragma once

#include "factor/internal/bilinear.h"
#include "factor/material.h"

namespace nacre::factor::internal {

/// Where the maps of a kTucker material are: f_t, then the coefficients a_cp of each
/// channel, then the shift.
inline int TuckerCoefficientMap(const Material& m, int channel, int power) {
  return m.terms + channel * (m.order + 1) + power;
}
/// Numbers of cells: whole, and never rounded otherwise.
inline int TuckerShiftMap(const Material& m) {
  return m.terms + static_cast<int>(m.channels.size()) * (m.order + 1);
}

/// The window cell at which the row of a point starts: its shift map.
std::int64_t TuckerShift(const Material& m, std::int64_t point);

/// Of the row that begins at `shift` and goes around the window's edges, the place of
/// `cell`.
std::int64_t ShiftedCell(int core, std::int64_t shift, std::int64_t cell);

/// R'_d of a kTucker material without row_scale: one cell, and a window.
float TuckerCell(const Material& m, int channel, GridIndex point, GridIndex cell);
void TuckerWindow(const Material& m, int channel, GridIndex point, float* window);

/// Σ_t f_t(x_i) h_t of all cells in the order of the window.
void TuckerIntensity(const Material& m, GridIndex point, double* intensity);

}  // namespace nacre::factor::internal

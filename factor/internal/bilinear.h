#pragma once

#include "factor/material.h"

namespace nacre::factor::internal {

/// A grid point, or a cell of a window.
struct GridIndex {
  int x = 0;
  int y = 0;
};

/// R'_d of a bilinear material, without row_scale. Of the two ways to see a pair of
/// points (from x_i along d, from x_o along −d) always the same one is evaluated, so
/// both are equal to the last bit. x_o beyond the maps takes their nearest point.
float BilinearCell(const Material& m, int channel, GridIndex point, GridIndex cell);

/// The whole window of a point: the same values.
void BilinearWindow(const Material& m, int channel, GridIndex point, float* window);

}  // namespace nacre::factor::internal

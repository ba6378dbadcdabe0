#pragma once

#include "core/exr.h"
#include "factor/internal/material_layout.h"
#include "factor/material.h"

#include <vector>

namespace nacre::factor::internal {

/// What a file holds of a material with steps: whole numbers from 0 on.
struct MaterialCodes {
  std::vector<float> f;
  std::vector<float> h;
  std::vector<float> row_scale;
  double f_least = 0;  ///< was subtracted from f's numbers
  double h_least = 0;
};

/// Throws a usage Error if a value isn't a whole multiple of its step.
MaterialCodes Encode(const Material& material);

/// Makes values of the whole numbers that f, h and row_scale hold.
void Decode(double f_least, double h_least, Material& material);

/// What the file holds in place of a sheet's whole numbers, each below 2²⁴: they are
/// predicted from their neighbours to the left and above in the picture (the median of
/// left, above and left + above − above left), what is left is folded into numbers from
/// 0 on (0, −1, 1, −2, …), and these are added up along rows, as PXR24 takes the
/// differences of a row. All modulo 2²⁴.
void Fold(const Sheet& sheet, ExrPart& part);
void Unfold(const Sheet& sheet, ExrPart& part);

/// The nearest number that 16-bit floats have, for 0 ≤ value ≤ 65504.
float RoundToHalf(float value);

}  // namespace nacre::factor::internal

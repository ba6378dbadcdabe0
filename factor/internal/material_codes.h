#pragma once

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

/// The nearest number that 16-bit floats have, for 0 ≤ value ≤ 65504.
float RoundToHalf(float value);

}  // namespace nacre::factor::internal

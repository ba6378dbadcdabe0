#pragma once

#include "factor/internal/method.h"

namespace nacre::factor::internal {

/// How a material's numbers were rounded.
struct Quantization {
  double bits = 32;  ///< of the map that needs most; 32: not rounded
  double added_l2 =
      0;  ///< growth of the relative L2 error on the sample, as a fraction
  double added_log = 0;  ///< the same of the log error
};

/// Rounds maps and kernels to whole multiples of steps, one a map and one a channel's
/// kernels. All steps follow from one number, so that every map adds the same error to
/// R_d: what matters little gets few bits. Kernels,
/// which are few but carry the faint tails, get a 32nd of a map's step. `bits` 4 to 16
/// are those of the map with the most; 32 leaves floats; 0 takes the fewest (of 4 to
/// 16, in halves) that let neither error on the sample grow by more than
/// kQuantizationGrowth, or floats if even 16 do
/// or floats pack better.
Quantization Quantize(const Job& job, double bits, Material& material);

inline constexpr double kQuantizationGrowth = 0.01;

}  // namespace nacre::factor::internal

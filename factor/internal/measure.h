#pragma once

#include "factor/internal/fit_error.h"
#include "factor/internal/method.h"

namespace nacre::factor::internal {

/// One pass over all slices: sets row_scale (of a sum: so that each slice's total over
/// the measured cells is the measured one, as far as its step and a factor of 2²⁴ steps
/// go) and albedo, and compares the material with the measurements it came from. Fills
/// the error figures and sizes of `summary`.
void Measure(Job& job, Material& material, FactorSummary& summary);

/// The error on the sample; slices of a sum are scaled to their totals.
FitError SampleError(const Job& job, const Material& material);

/// What a modelled slice is multiplied by for its total over the measured cells to be
/// the measured one: 1 where the model is zero, 0 where the measured total is negative.
double TotalScale(std::span<const float> rd,
                  std::span<const std::uint8_t> valid,
                  std::span<const float> modelled);

}  // namespace nacre::factor::internal

#pragma once

#include "factor/internal/bilinear_fit.h"

namespace nacre::factor::internal {

/// Of the mean diagonal of normal equations.
inline constexpr double kBilinearRidge = 1e-7;

/// Finds fit.h, given fit.f, by least squares over pairs, an offset at a time; `stride`
/// > 1 takes one in so many of them. Returns the root of the weighted share of squares
/// that is left. Ranks share the offsets.
double SolveAllKernels(const BilinearData& data,
                       int stride,
                       const Workers& workers,
                       BilinearFit& fit);

}  // namespace nacre::factor::internal

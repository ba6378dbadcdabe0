#pragma once

#include "core/exr.h"
#include "core/progress.h"
#include "rigs/transport/transport.h"

namespace nacre::rigs {

/// What the phantom looks like under a pattern of light: `illumination` is the
/// irradiance that arrives at normal incidence, row by row from the top, over the
/// area of the phantom's grid (points × pitch), one channel for each of the phantom's
/// by name; flux a mm². The result is the radiant exitance, same size, same unit:
///   M(x_o) = Σ_pixels F_t(η, 1) E(x_i) a² · mean of R_d(x_i, ·) over the pixel of x_o,
/// with the light of each pixel of side a entering at its centre. Costs grow with the
/// square of the number of lit pixels. Throws BadData for other channels or pixels that
/// aren't square.
ExrPart PhotographUnder(const Phantom& phantom,
                        Solver solver,
                        const ExrPart& illumination,
                        int thread_count = 0,
                        const ProgressFunction& progress = {});

}  // namespace nacre::rigs

#pragma once

#include "core/exr.h"
#include "core/progress.h"
#include "rigs/transport/transport.h"

namespace nacre::rigs {

struct Photo {
  ExrPart exitance;
  ExrPart standard_error;  ///< no pixels if the solver has no noise
};

/// What the phantom looks like under a pattern of light: `illumination` is the
/// irradiance that arrives along the beam's direction, row by row from the top, over
/// the area of the phantom's grid (points × pitch), one channel for each of the
/// phantom's by name; flux a mm². The result is the radiant exitance, same size, same
/// unit:
///   M(x_o) = Σ_pixels F_t(η, cos θ) E(x_i) a² · mean of R_d(x_i, ·) over x_o's pixel,
/// with the light of each pixel of side a entering as the phantom's beam around its
/// centre. Monte Carlo follows photons of the whole picture at once, options.photons a
/// channel; of other solvers the costs grow with the square of the number of lit
/// pixels. Throws BadData for other channels, pixels that aren't square, and light that
/// is negative or not finite.
Photo PhotographUnder(const Phantom& phantom,
                      Solver solver,
                      const ExrPart& illumination,
                      const SolverOptions& options,
                      const ProgressFunction& progress = {});
ExrPart PhotographUnder(const Phantom& phantom,
                        Solver solver,
                        const ExrPart& illumination,
                        int thread_count = 0,
                        const ProgressFunction& progress = {});

}  // namespace nacre::rigs

#pragma once

#include "core/progress.h"
#include "factor/internal/reciprocal_data.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/workers.h"

namespace nacre::factor::internal {

/// The reciprocal model while it is being fitted: in peaks of a channel, R_d is the
/// exponential of what kernels and maps add up to (factor/material.h).
struct ReciprocalFit {
  SharedMaps f;  ///< uncorrelated over the grid, mean 0, mean square 1
  int taps = 2;
  Eigen::MatrixXd h;  ///< a column a channel and cell, a row a kernel
  int rounds = 0;

  int Terms() const { return static_cast<int>(f.rows()); }
};

/// How kernels are fitted: from those for the logarithms of what was measured, where
/// these are better than what there is, or on from what they are.
enum class KernelStart { kLogarithms, kGoOn };

/// Weighted least squares for the kernels of all held offsets (or of all), given the
/// maps, an offset and channel at a time, in R_d: Gauss–Newton with the exponential
/// linearised. Ranks share offsets. Returns Σ weight · error² over the sample of those
/// offsets.
double SolveReciprocalKernels(const ReciprocalData& data,
                              KernelStart start,
                              bool all_cells,
                              const Workers& workers,
                              ReciprocalFit& fit);

/// Makes of each pair's variance its weight, 1 / (variance + tolerance): the tolerance
/// is that at what the model says. Of the held pairs, and of the sample.
void SetHeldWeights(const ReciprocalFit& fit, int thread_count, ReciprocalData& data);
void SetSampleWeights(const ReciprocalFit& fit, int thread_count, ReciprocalData& data);

/// The Gauss–Newton step of all maps at once, given the kernels: conjugate gradients on
/// the normal equations, preconditioned by each point's own block. Standard deviations
/// of 1 are known of the maps beforehand, which holds points that little was measured
/// of. Ranks share sums over offsets. `pull` is half of what the error falls by along a
/// change of the maps.
struct MapChange {
  SharedMaps step;
  SharedMaps pull;
};
MapChange MapStep(const ReciprocalData& data,
                  const ReciprocalFit& fit,
                  const Workers& workers);

/// Follows MapStep, each time with kernels that fit the maps, until it gains little. No
/// round raises the error. Maps end turned so that each contributes as much as possible
/// after those before it, signs canonical.
ReciprocalFit FitReciprocal(ReciprocalData& data,
                            const SharedMaps& start,
                            int taps,
                            const Workers& workers,
                            const ProgressFunction& progress);

}  // namespace nacre::factor::internal

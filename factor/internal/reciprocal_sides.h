#pragma once

#include "factor/internal/reciprocal_data.h"

#include <vector>

namespace nacre::factor::internal {

/// Both measurements of the pairs of one channel and near offset: what enters at the
/// first point, and what enters at the second; peaks, and their variances, negative
/// where nothing was measured. Planes as those of ReciprocalData.
struct PairSides {
  explicit PairSides(std::size_t plane)
      : first{std::vector<float>(plane, 0.0F), std::vector<float>(plane, -1.0F)},
        second(first) {}
  Pairs first;
  Pairs second;
};

/// Offsets whose pairs are looked at from both sides: up to two points away.
std::vector<int> NearCells(const ReciprocalData& data);

/// What a dataset has that no reciprocal model has: light enters at a point and leaves
/// from a whole cell. Where the medium changes within cells, the two directions differ,
/// by nearly the same in all directions and distances:
///   ln R(x_i → x_o) = symmetric + g(d) (q(x_i) − q(x_o)),
/// q a map (mean 0, mean square 1 over the grid), g kernels, even in d.
/// Sets `data.sides` and `data.sides_near` by alternating least squares of
/// ln R(x_i → x_o) − ln R(x_o → x_i), errors weighted as those of R_d, and leaves both
/// empty if less than half of the difference is that.
///
/// `near` is a channel's NearCells(data) one after the other.
void FitSides(const std::vector<PairSides>& near,
              int thread_count,
              ReciprocalData& data);

/// Makes one number of the measurements of near pairs, in `data.pairs` and
/// `data.sample`: the symmetric part, given data.sides.
void MergeSides(const std::vector<PairSides>& near, ReciprocalData& data);

/// Adds map q and kernels g to a reciprocal material: those of offsets that aren't near
/// are fitted to the sampled slices, given the material's symmetric part.
void AddSides(const Job& job, const ReciprocalData& data, Material& material);

}  // namespace nacre::factor::internal

#pragma once

#include "core/progress.h"
#include "reconstruct/slice_source.h"

#include <filesystem>
#include <vector>

namespace nacre::reconstruct {

/// What an edit does, as in SubEdit [Song et al. 2009]: R_d(x_i, x_o) is taken as what
/// both ends agree on, so that each point has a profile of its own that may be changed.
/// Vectors hold one number a grid point, or are empty for "everywhere as it is".
struct Edit {
  std::vector<std::vector<float>> albedo = {};  ///< [channel][point]: factor, > 0
  std::vector<float> range = {};                ///< factor on distances, 0.1 to 10
  std::vector<float> shape = {};  ///< power of the profile at the same total, 0.2 to 5
  const SliceSource* other = nullptr;  ///< on the same grid, to be mixed in
  std::vector<float> mix = {};         ///< its share, 0 to 1
  int tile_overlap = 0;  ///< > 0: opposite borders are blended over so many points, so
                         ///< that the sample repeats without a seam; it loses them
};

/// What was done, for who reads it.
struct EditSummary {
  int points_x = 0;
  int points_y = 0;
  double largest_total = 0;  ///< of a slice and channel, before energy was bounded
  std::int64_t bounded = 0;  ///< slices and channels scaled down to give ≤ 1
};

/// Writes the edited dataset. With E(x, ·) the edited profile of point x,
///   R(x_i, x_o) = √(E(x_i, d) E(x_o, −d)) / max(1, T(x_i), T(x_o)),
/// T being the total of a slice before that division: reciprocal to rounding, and no
/// slice gives more than came in. Where x_o lies beyond the grid, E(x_i, d) alone
/// counts. An empty edit thus makes a dataset reciprocal. Sigma is written as 0
/// (unknown). Memory: `core` rows of slices. Two passes. Throws BadData if `other` has
/// another grid, or for an overlap that leaves fewer than `core` points.
EditSummary WriteEdited(const SliceSource& source,
                        const Edit& edit,
                        const std::string& provenance,
                        const std::filesystem::path& out,
                        const ProgressFunction& progress);

}  // namespace nacre::reconstruct

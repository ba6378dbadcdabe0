#pragma once

#include "core/progress.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <vector>

namespace nacre::cli::report {

/// Mean over the slices of the ring means of R_d, and how they scatter.
struct RadialProfile {
  std::vector<double> radius_mm;
  std::vector<double> mean;  ///< mm⁻²
  std::vector<double> low;   ///< 10 % of the slices lie below
  std::vector<double> high;  ///< 10 % lie above
};

/// A slice kept for showing.
struct SampleSlice {
  int i = 0;
  int j = 0;
  std::vector<float> rd;  ///< as in reconstruct::RdSlice
};

/// What one pass over a dataset tells, a channel at a time where it says so.
struct DatasetDigest {
  reconstruct::RdHeader header;
  std::vector<std::vector<float>> albedo;  ///< [channel][point]: Σ_d R_d · pitch²
  std::vector<double> peak;                ///< [channel], mm⁻²
  std::vector<RadialProfile> profiles;     ///< [channel]
  std::vector<float> valid_fraction;       ///< [point]
  double missing = 0;                      ///< of all cells
  double noise = 0;  ///< √(Σ σ² / Σ R²); 0 where the dataset states none
  /// Reciprocity: √(Σ (R(x_i, x_o) − R(x_o, x_i))² / Σ (R² + R²)) over all pairs within
  /// the grid, a channel, and what the stated noise alone would give.
  std::vector<double> asymmetry;
  std::vector<double> noise_asymmetry;
  std::vector<float> asymmetry_map;  ///< [point]: the same of pairs that a point is in
  std::int64_t pair_count = 0;       ///< a channel
  std::vector<SampleSlice> samples;
};

/// One pass, slice after slice; memory is that of `core` rows of slices.
DatasetDigest Digest(reconstruct::RdReader& reader, const ProgressFunction& progress);

}  // namespace nacre::cli::report

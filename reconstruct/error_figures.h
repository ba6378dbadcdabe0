#pragma once

#include "core/json_fwd.h"
#include "core/progress.h"
#include "reconstruct/slice_source.h"

#include <cstdint>
#include <string>

namespace nacre::reconstruct {

/// How far a test `b` is from a reference `a`. Sums run over the values that are valid
/// in both; all channels count alike.
struct ErrorFigures {
  std::int64_t value_count = 0;    ///< compared
  std::int64_t invalid_count = 0;  ///< left out: not valid in one of the two
  double relative_l2 = 0;          ///< √(Σ (b − a)² / Σ a²)
  double rmse = 0;                 ///< √(mean (b − a)²), in the values' unit
  double rmse_over_mean = 0;       ///< rmse / mean a
  double peak = 0;                 ///< max a
  double psnr_db = 0;              ///< 20 log₁₀(peak / rmse)
  double log_rms = 0;    ///< √(mean (ln b − ln a)²), values below log_floor raised
                         ///< to it, where a > log_floor
  double log_floor = 0;  ///< kLogFloor · peak
  std::int64_t log_count = 0;
  double worst_slice = 0;  ///< largest relative_l2 of one slice and channel
  int worst_slice_i = 0;
  int worst_slice_j = 0;
  double worst_total = 0;  ///< largest |Σ b / Σ a − 1| of one slice and channel
  int worst_total_i = 0;
  int worst_total_j = 0;
  double energy_ratio = 0;  ///< Σ b / Σ a
  double max_albedo_a = 0;  ///< largest Σ a · pitch² of one slice and channel
  double max_albedo_b = 0;

  Json ToJson() const;
  std::string ToString(const std::string& unit) const;
};

/// The noise of a good measurement, relative to the peak: what lies below is not
/// compared on a log scale.
constexpr double kLogFloor = 1e-5;

/// Compares slice by slice, in two passes over `a` (the first finds the peak). Throws
/// BadData if grids, cores or channels differ, naming both.
ErrorFigures CompareSlices(const SliceSource& a,
                           const SliceSource& b,
                           const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct

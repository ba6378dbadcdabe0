#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/session_state.h"
#include "core/options.h"
#include "core/progress.h"
#include "reconstruct/reciprocity.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::reconstruct {

/// `incremental`, `memory_bytes`, `max_age_days`, `thread_count` and `ranks` aren't
/// listed in Visit: they don't change a bit of the result.
struct ReconstructOptions {
  bool subtract_crosstalk = true;
  bool sharpen_spot = true;
  bool state_systematics = true;
  bool remove_gloss = true;
  bool symmetrize = false;
  double specular_radius_cells = -1;

  /// Go on from `OUT.work` of an earlier run, take an incomplete session (its missing
  /// slices aren't valid) and leave `OUT.work` behind.
  bool incremental = false;
  double memory_bytes = 512e6;   ///< for frames under way, at least one is
  int thread_count = 0;          ///< 0: all cores
  const Ranks* ranks = nullptr;  ///< that share the work; null: this process alone
  double max_age_days = calibrate::kMaxAgeDays;  ///< see calibrate::CompareAge

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("subtract_crosstalk",
          self.subtract_crosstalk,
          Range{},
          "take away the light of the picture's other spots, extrapolated");
    visit(
        "sharpen_spot", self.sharpen_spot, Range{}, "undo the width of the laser spot");
    visit("state_systematics",
          self.state_systematics,
          Range{},
          "sigma includes what the calibration's own uncertainty makes of a value");
    visit("remove_gloss",
          self.remove_gloss,
          Range{},
          "take the surface's own reflection out of the lit cell, known by its shape");
    visit("specular_radius_cells",
          self.specular_radius_cells,
          Range{-1, 100},
          "cells this near to the lit point count as not measured and are filled from "
          "outside; 0: the lit cell alone, -1: none");
    visit("symmetrize",
          self.symmetrize,
          Range{},
          "average R_d(x_i, x_o) and R_d(x_o, x_i) by their variances: less noise, but "
          "wrong by half of their true difference (reported)");
  }
};

struct ReconstructSummary {
  std::int64_t slice_count = 0;
  std::int64_t frame_count = 0;
  std::int64_t saturated_count = 0;  ///< pixels of merged frames that no exposure saved
  std::int64_t invalid_count = 0;    ///< values not measured
  std::int64_t below_floor_count = 0;  ///< of these, below the glare's floor
  double max_crosstalk = 0;            ///< subtracted, relative to a slice's total
  double spot_sigma_mm = 0;         ///< of the laser as seen; 0 if it wasn't measured
  std::int64_t group_count = 0;     ///< of spots lit together
  std::int64_t groups_reused = 0;   ///< from an earlier run
  std::int64_t groups_missing = 0;  ///< not captured yet
  bool is_dense = false;            ///< windows overlapped and were separated
  std::vector<double> tail_spread;  ///< a channel: how far tails are off, relative
  ReciprocityFigures reciprocity;
  double symmetrize_change = 0;       ///< Σ |change| / Σ R_d, if asked for
  std::vector<std::string> warnings;  ///< "name: sentence", as calibrate/ names them
  double symmetrize_worst_total = 0;  ///< largest relative change of a slice's total
  int thread_count_used = 0;
  double seconds = 0;
  std::string Brief() const;  ///< one line for the log
};

/// A complete session and the calibration of its rig to `*.rd.exr`, group of spots by
/// group of spots (method and equations: reconstruct/README.md). Throws BadData if the
/// two aren't of the same rig or pictures are missing (but see `incremental`). The
/// bytes written don't depend on threads, ranks, memory or earlier runs. Of several
/// ranks each merges its share of the pictures into a file beside `out` that all can
/// see, and finishes its share of the slices; the root writes, and its summary is the
/// whole one.
ReconstructSummary Reconstruct(const acquire::SessionReader& session,
                               const calibrate::Calibration& calibration,
                               const std::filesystem::path& out,
                               const ReconstructOptions& options,
                               const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct

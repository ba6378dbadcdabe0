#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "core/options.h"
#include "core/progress.h"

#include <cstdint>
#include <filesystem>
#include <string>

namespace nacre::reconstruct {

/// `memory_bytes` and `thread_count` aren't listed in Visit: they don't change a bit of
/// the result.
struct ReconstructOptions {
  bool subtract_crosstalk = true;
  bool sharpen_spot = true;

  double memory_bytes = 512e6;  ///< for frames under way, at least one is
  int thread_count = 0;         ///< 0: all cores

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("subtract_crosstalk",
          self.subtract_crosstalk,
          Range{},
          "take away the light of the picture's other spots, extrapolated");
    visit("sharpen_spot",
          self.sharpen_spot,
          Range{},
          "undo the width of the laser spot to first order");
  }
};

struct ReconstructSummary {
  std::int64_t slice_count = 0;
  std::int64_t frame_count = 0;
  std::int64_t saturated_count = 0;  ///< pixels of merged frames that no exposure saved
  std::int64_t invalid_count = 0;    ///< values not measured
  double max_crosstalk = 0;          ///< subtracted, relative to a slice's total
  double spot_sigma_mm = 0;          ///< of the laser as seen; 0 if it wasn't measured
  int thread_count_used = 0;
  double seconds = 0;
  std::string Brief() const;  ///< one line for the log
};

/// A complete session and the calibration of its rig to `*.rd.exr`, group of spots by
/// group of spots (method and equations: reconstruct/README.md). Throws BadData if the
/// two aren't of the same rig or pictures are missing. The bytes written don't depend
/// on threads or memory.
ReconstructSummary Reconstruct(const acquire::SessionReader& session,
                               const calibrate::Calibration& calibration,
                               const std::filesystem::path& out,
                               const ReconstructOptions& options,
                               const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct

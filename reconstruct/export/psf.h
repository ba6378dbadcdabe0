#pragma once

#include "core/options.h"
#include "core/progress.h"

#include <cstdint>
#include <filesystem>
#include <string>

namespace nacre::reconstruct {

struct ExportOptions {
  bool clamp_negative = false;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("clamp_negative",
          self.clamp_negative,
          Range{},
          "write negative values (noise) as 0 and count them, instead of refusing");
  }
};

struct ExportSummary {
  std::int64_t bytes = 0;
  std::int64_t clamped_count = 0;  ///< negative values written as 0
  std::int64_t invalid_count = 0;  ///< values written though the dataset says invalid
  std::string Brief() const;       ///< one line for the log
};

/// `*.rd.exr` to the raw "psf" layout, slice by slice, keeping the bits of every float.
/// Noise and validity have no place there and are lost, as are pitch and index. Throws
/// UsageError unless there are three channels, BadData for negative values unless they
/// are clamped.
ExportSummary ExportPsf(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ExportOptions& options,
                        const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct

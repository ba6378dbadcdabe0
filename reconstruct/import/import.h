#pragma once

#include "core/options.h"

#include <cstdint>
#include <string>

namespace nacre::reconstruct {

/// What an archived scan doesn't say about itself.
struct ImportOptions {
  double pitch_mm = 0;  ///< has no default: units aren't guessed
  double eta = 1;
  bool clamp_negative = false;
  double scale = 1;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("pitch_mm",
          self.pitch_mm,
          Range{0, 1e6},
          "distance of neighbouring grid points and cells, mm (required)");
    visit("eta", self.eta, Range{1, 10}, "refractive index of the sample");
    visit("clamp_negative",
          self.clamp_negative,
          Range{},
          "read negative values as 0 and count them, instead of refusing the file");
    visit("scale",
          self.scale,
          Range{0, 1e30},
          "R_d in mm^-2 that the value 1 stands for");
  }
};

struct ImportSummary {
  int points_x = 0;
  int points_y = 0;
  int core = 0;
  int channel_count = 0;
  std::int64_t clamped_count = 0;  ///< negative values read as 0
  std::int64_t invalid_count = 0;  ///< cells outside the pictures
  std::string Brief() const;       ///< one line for the log
};

}  // namespace nacre::reconstruct

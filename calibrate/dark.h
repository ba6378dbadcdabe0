#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"

#include <vector>

namespace nacre::calibrate {

/// What the pictures without light say.
struct DarkResult {
  DarkLevel level;                    ///< of the pixels that aren't hot
  std::vector<HotPixel> hot_pixels;   ///< ascending
  double spread_counts_per_us = 0;    ///< of the others' dark current
  double row_noise_counts = 0;        ///< 0 if it isn't found
  double variance_counts2 = 0;        ///< of a pixel from one picture to the next
  double variance_sigma_counts2 = 0;  ///< standard uncertainty of it
};

/// A line over the exposures through every pixel's mean counts; a pixel is hot if its
/// slope lies five standard deviations off, and a count in the longest exposure. The
/// variances are those of pairs, in which all that is fixed cancels.
DarkResult EstimateDarkMaps(const acquire::SessionReader& session);

/// Smooth ambient light, counts per µs, of the pictures with the laser off: pose 0 the
/// reference, pose 1 the sample; of a mosaic, of the colour that sees most. Empty if
/// there are none, or no light in them.
SmoothField EstimateAmbient(const acquire::SessionReader& session,
                            const DarkResult& dark,
                            const Linearity& linearity,
                            const ColourFilters& filters,
                            int pose);

}  // namespace nacre::calibrate

#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/rate_picture.h"

namespace nacre::calibrate {

struct GlareResult {
  Glare glare;        ///< empty if there are no pictures for it, or it isn't seen
  Blooming blooming;  ///< 0 if nothing overflowed
};

/// Glare from the pictures of an opaque target that is lit at one spot: whatever is
/// seen `beyond_px` from the spot was scattered there. Of each pixel the longest
/// exposure counts that doesn't saturate; where one does, neither do the columns it may
/// have spilled into. Those columns, compared to shorter exposures, show how far it
/// spilled.
GlareResult EstimateGlare(const acquire::SessionReader& session,
                          const RatePictures& pictures,
                          PixelPoint spot_px,
                          double saturation_counts,
                          double beyond_px);

}  // namespace nacre::calibrate

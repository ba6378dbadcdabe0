#pragma once

#include "acquire/session.h"
#include "calibrate/dark.h"

#include <vector>

namespace nacre::calibrate {

/// A point of the response curve, for figures: mean counts above dark of a part of the
/// flat pictures, and how they compare to a straight line before and after correction.
struct ResponsePoint {
  double counts = 0;
  double exposure_us = 0;
  double deviation = 0;  ///< counts / (rate · exposure) − 1
  double residual = 0;   ///< the same once made linear
};

struct ResponseResult {
  Linearity linearity;
  std::vector<ResponsePoint> points;
};

/// The curvature of the response from white card at several exposures: each part of the
/// picture has a rate of its own, which all its exposures share. Pictures from
/// `saturation_counts` on are left out. Straight if two exposures are left at most.
ResponseResult EstimateResponse(const acquire::SessionReader& session,
                                const DarkResult& dark,
                                double saturation_counts);

/// The relative response over the picture, from the same pictures: mean 1.
struct FlatResult {
  SmoothField field;
  double residual = 0;  ///< rms of blocks of 8 × 8 pixels, relative
  double noise = 0;     ///< what photons alone would leave of it
};
FlatResult EstimateFlatField(const acquire::SessionReader& session,
                             const DarkResult& dark,
                             const Linearity& linearity,
                             double saturation_counts,
                             double gain_electrons_per_count);

}  // namespace nacre::calibrate

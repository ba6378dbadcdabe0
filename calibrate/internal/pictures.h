#pragma once

#include "acquire/session.h"
#include "calibrate/corrections.h"

#include <cstdint>
#include <vector>

namespace nacre::calibrate::internal {

/// Numbers of the calibration pictures of a target, in order; of one channel or pose if
/// that isn't −1.
std::vector<std::int64_t> PicturesOf(const acquire::SessionReader& session,
                                     acquire::Target target,
                                     int channel = -1,
                                     int pose = -1);

double MeanCounts(const acquire::Frame& frame);

/// A mask of a picture's hot pixels; empty if there are none.
std::vector<bool> MaskOf(const std::vector<HotPixel>& pixels, std::size_t pixel_count);

/// Replaces hot pixels by the mean of their neighbours that aren't; those are `step`
/// pixels away, 2 in a mosaic.
void FillHotPixels(const std::vector<HotPixel>& pixels,
                   int width,
                   int step,
                   std::vector<float>& picture);

}  // namespace nacre::calibrate::internal

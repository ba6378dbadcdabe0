#pragma once

#include "acquire/camera.h"

#include <string>

namespace nacre::cli::preview {

/// A frame as an 8-bit RGB PNG of at most `max_side_px`: the square root of the counts
/// as grey, pixels at the converter's last count red.
std::string FramePng(const acquire::Frame& frame,
                     const acquire::CameraInfo& camera,
                     int max_side_px);

}  // namespace nacre::cli::preview

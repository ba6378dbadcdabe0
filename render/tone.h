#pragma once

#include "core/exr.h"
#include "core/png.h"

namespace nacre::render {

/// A linear picture as 8-bit sRGB, multiplied by 2^exposure_ev first; clipped at white.
/// Keeps an alpha channel. Takes R, G, B or the first channel.
PngImage ToPng(const ExrPart& image, double exposure_ev = 0);

}  // namespace nacre::render

#pragma once

#include "core/exr.h"
#include "render/features.h"

namespace nacre::render {

/// Throws a usage Error if there is no denoiser: before a picture is made for it.
void RequireDenoiser();

/// The picture without its noise, by Intel Open Image Denoise, of which the shared
/// library (version 2 or 1) is looked for when this is called: in
/// NACRE_OIDN_LIBRARY, or where the system has its libraries. Channels R, G, B or Y are
/// denoised, A stays. The result is biased, and its error isn't known.
/// Throws a usage Error if the library isn't found, Error if it fails.
ExrPart Denoise(const ExrPart& image, const FeatureImages& features);

}  // namespace nacre::render

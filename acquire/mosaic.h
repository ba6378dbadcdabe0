#pragma once

#include "acquire/camera.h"

#include <string>

namespace nacre::acquire {

/// Makes a monochrome frame of the same size of a colour camera's: the mean of a
/// mosaic's two by two pixels, to the right and below; the mean of a pixel's three
/// colours. Half a pixel of shift, the same everywhere, is all that geometry loses by
/// it. A monochrome frame stays as it is. `mosaic` as in CameraInfo.
void MakeGrey(Frame& frame, const std::string& mosaic);

}  // namespace nacre::acquire

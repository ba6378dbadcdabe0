#pragma once

#include "acquire/camera.h"

#include <cstdint>
#include <string>

namespace nacre::acquire {

/// Whether each pixel has one colour, that of its place: "RGGB" and the like.
inline bool IsMosaic(const std::string& mosaic) {
  return mosaic.size() == 4;
}

/// The colour of a pixel of such a sensor: 0 red, 1 green, 2 blue. `mosaic` names the
/// upper left two by two pixels, row by row.
inline int ColourAt(const std::string& mosaic, int column, int row) {
  const char colour =
      mosaic[static_cast<std::size_t>(std::int64_t{row & 1} * 2 + (column & 1))];
  return colour == 'R' ? 0 : colour == 'G' ? 1 : 2;
}

/// Makes a monochrome frame of the same size of a colour camera's: the mean of a
/// mosaic's two by two pixels, to the right and below; the mean of a pixel's three
/// colours. Half a pixel of shift, the same everywhere, is all that geometry loses by
/// it. A monochrome frame stays as it is. `mosaic` as in CameraInfo.
void MakeGrey(Frame& frame, const std::string& mosaic);

}  // namespace nacre::acquire

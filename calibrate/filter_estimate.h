#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/dark.h"

namespace nacre::calibrate {

/// What each colour of a mosaic sees of the lamp (white card), of ambient light and of
/// every laser (lattice on the reference), relative to the colour that sees most: means
/// over all pixels of a colour. Throws BadData if the camera gives three counts a
/// pixel, or no colour sees a laser. Monochrome: nothing to know.
ColourFilters EstimateFilters(const acquire::SessionReader& session,
                              const DarkResult& dark);

/// The lamp's part of it, which the checkerboard's corners need to begin with.
std::array<double, 3> EstimateWhite(const acquire::SessionReader& session);

}  // namespace nacre::calibrate

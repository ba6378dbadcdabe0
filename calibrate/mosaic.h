#pragma once

#include "calibrate/calibration.h"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

/// Pictures of a sensor with a colour mosaic. Colours are never mixed: each of the four
/// interleaved planes of pixels is a picture of its own, taken by a camera of half the
/// resolution (PlaneCamera).
namespace nacre::calibrate {

/// Every `step`-th pixel from (column, row) on, both ways.
struct MosaicPlane {
  int column = 0;
  int row = 0;
  int step = 1;    ///< 2 of a mosaic
  int colour = 0;  ///< as in acquire::ColourAt; 0 of a monochrome sensor
};

/// All of them: one of a monochrome sensor, four of a mosaic.
std::vector<MosaicPlane> PlanesOf(const std::string& mosaic);

/// A plane that sees a laser, and what part it has in the mean over planes.
struct PlaneShare {
  MosaicPlane plane;
  double weight = 1;  ///< all add up to 1
};

/// Planes whose filters let enough of that laser through; their weights go as that,
/// which leaves the least noise of photons.
std::vector<PlaneShare> SharesOf(const ColourFilters& filters, int channel);

/// The camera whose pixels are those of one plane. They see half of their own pitch
/// each way (`PlaneAperture`).
CameraGeometry PlaneCamera(const CameraGeometry& camera, const MosaicPlane& plane);
inline double PlaneAperture(const MosaicPlane& plane) {
  return 1.0 / plane.step;
}

/// Multiplies every pixel by the value of its colour.
void ScaleColours(const std::string& mosaic,
                  const std::array<double, 3>& values,
                  int width_px,
                  std::vector<float>& picture);

/// Divides each pixel by what its colour is of the strongest. Nothing without a mosaic.
void Balance(const std::string& mosaic,
             const std::array<double, 3>& shares,
             int width_px,
             std::vector<float>& picture);

/// A laser's picture as if every pixel saw it: balanced, and those that don't see the
/// laser are the mean of their neighbours that do. For whatever needs light everywhere
/// (glare) or looks for shapes; sums over it are those over the seeing pixels, each for
/// its share of the plane.
void FillIn(const ColourFilters& filters,
            int channel,
            int width_px,
            std::vector<float>& picture);

/// Ambient light, counts per µs a pixel; empty if there is none.
std::vector<float> AmbientMap(const SmoothField& field,
                              const ColourFilters& filters,
                              int width_px,
                              int height_px);

/// Per pixel, which part it has in a laser's sums: 1 a pixel without a mosaic, on the
/// average with one.
std::vector<float> PixelShares(const ColourFilters& filters,
                               int channel,
                               int width_px,
                               int height_px);

}  // namespace nacre::calibrate

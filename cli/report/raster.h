#pragma once

#include "core/png.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace nacre::cli::report {

/// A plane of numbers, row by row from the top.
struct Plane {
  int width = 0;
  int height = 0;
  std::span<const float> values;
};

/// log₁₀ scale from `low` (> 0) to `high`, sequential colours; what isn't positive is
/// `low`.
PngImage LogImage(const Plane& plane, double low, double high);

/// Linear scale, sequential colours.
PngImage LinearImage(const Plane& plane, double low, double high);

/// From −limit to limit, diverging colours. A limit of 0 stands for the largest
/// magnitude of the plane.
PngImage DivergingImage(const Plane& plane, double limit = 0);

/// Linear RGB (three planes) or grey (one), times `gain`, as sRGB.
PngImage ColorImage(const std::vector<Plane>& channels, double gain);

/// Averages blocks of n × n so that neither side exceeds `max_side`.
struct OwnedPlane {
  int width = 0;
  int height = 0;
  std::vector<float> values;
  Plane View() const { return {width, height, values}; }
};
OwnedPlane Shrink(const Plane& plane, int max_side);

/// A colour bar between two labels (HTML): sequential or diverging.
std::string ColorScale(const std::string& low, const std::string& high, bool diverging);

}  // namespace nacre::cli::report

#pragma once

#include "core/error.h"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace nacre::rigs {

/// What a colour filter lets through of a light, for red, green and blue pixels.
using FilterShares = std::array<double, 3>;

/// The filters over a sensor's pixels; none by default. Filters never part lasers
/// perfectly: each lets some of its neighbours' light through.
struct FilterModel {
  std::string mosaic;  ///< as in acquire::CameraInfo
  FilterShares white{1, 1, 1};
  std::vector<FilterShares> lasers;  ///< a channel

  FilterShares Laser(std::size_t channel) const {
    if (mosaic.empty()) {
      return {1, 1, 1};
    }
    Expect(channel < lasers.size(), "filters for each laser channel");
    return lasers[channel];
  }
};

/// Multiplies each pixel by what its filter lets through; nothing without a mosaic.
void ApplyFilters(const std::string& mosaic,
                  const FilterShares& shares,
                  int width_px,
                  std::vector<float>& picture);

}  // namespace nacre::rigs

#include "rigs/colour_filters.h"

#include "acquire/mosaic.h"

namespace nacre::rigs {

void ApplyFilters(const std::string& mosaic,
                  const FilterShares& shares,
                  int width_px,
                  std::vector<float>& picture) {
  if (mosaic.empty()) {
    return;
  }
  const auto width = static_cast<std::size_t>(width_px);
  for (std::size_t begin = 0; begin < picture.size(); begin += width) {
    const int row = static_cast<int>(begin / width);
    const std::array<float, 2> share = {
        static_cast<float>(
            shares[static_cast<std::size_t>(acquire::ColourAt(mosaic, 0, row))]),
        static_cast<float>(
            shares[static_cast<std::size_t>(acquire::ColourAt(mosaic, 1, row))])};
    for (std::size_t x = 0; x < width; ++x) {
      picture[begin + x] *= share[x & 1];
    }
  }
}

}  // namespace nacre::rigs

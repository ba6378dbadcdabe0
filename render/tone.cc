#include "render/tone.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {

PngImage ToPng(const ExrPart& image, double exposure_ev) {
  const float gain = static_cast<float>(std::exp2(exposure_ev));
  const bool colour = image.FindChannel("R") >= 0 && image.FindChannel("G") >= 0 &&
                      image.FindChannel("B") >= 0;
  const int alpha = image.FindChannel("A");
  std::vector<int> channels =
      colour ? std::vector<int>{image.FindChannel("R"),
                                image.FindChannel("G"),
                                image.FindChannel("B")}
             : std::vector<int>{std::max(0, image.FindChannel("Y"))};
  PngImage png;
  png.width = image.width;
  png.height = image.height;
  png.channel_count = static_cast<int>(channels.size()) + (alpha >= 0 ? 1 : 0);
  png.values.reserve(image.PixelCount() * static_cast<std::size_t>(png.channel_count));
  for (std::size_t i = 0; i < image.PixelCount(); ++i) {
    for (const int channel : channels) {
      png.values.push_back(
          SrgbFromLinear(gain * image.Channel(static_cast<std::size_t>(channel))[i]));
    }
    if (alpha >= 0) {
      const float a = image.Channel(static_cast<std::size_t>(alpha))[i];
      png.values.push_back(
          static_cast<std::uint16_t>(std::lround(255 * std::clamp(a, 0.0F, 1.0F))));
    }
  }
  return png;
}

}  // namespace nacre::render

#include "cli/preview/frame_png.h"

#include "core/png.h"

#include <algorithm>
#include <cmath>

namespace nacre::cli::preview {

std::string FramePng(const acquire::Frame& frame,
                     const acquire::CameraInfo& camera,
                     int max_side_px) {
  const int step = std::max(
      1, (std::max(frame.width, frame.height) + max_side_px - 1) / max_side_px);
  const int samples = camera.SamplesPerPixel();
  const int full = (1 << camera.bit_depth) - 1;
  PngImage image{.width = (frame.width + step - 1) / step,
                 .height = (frame.height + step - 1) / step,
                 .channel_count = 3,
                 .bit_depth = 8,
                 .values = {}};
  for (int top = 0; top < frame.height; top += step) {
    for (int left = 0; left < frame.width; left += step) {
      std::int64_t sum = 0;
      std::int64_t n = 0;
      bool saturated = false;
      for (int y = top; y < std::min(top + step, frame.height); ++y) {
        const std::size_t row =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width);
        const std::size_t begin =
            (row + static_cast<std::size_t>(left)) * static_cast<std::size_t>(samples);
        const int columns = std::min(step, frame.width - left) * samples;
        for (int k = 0; k < columns; ++k, ++n) {
          const int count = frame.counts[begin + static_cast<std::size_t>(k)];
          sum += count;
          saturated = saturated || count >= full;
        }
      }
      const auto grey = static_cast<std::uint16_t>(std::lround(
          255 * std::sqrt(static_cast<double>(sum) / static_cast<double>(n) / full)));
      image.values.push_back(saturated ? 255 : grey);
      image.values.push_back(saturated ? std::uint16_t{40} : grey);
      image.values.push_back(saturated ? std::uint16_t{40} : grey);
    }
  }
  return EncodePng(image, 1);
}

}  // namespace nacre::cli::preview

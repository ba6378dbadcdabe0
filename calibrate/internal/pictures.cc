#include "calibrate/internal/pictures.h"

#include <algorithm>
#include <cstdint>

namespace nacre::calibrate::internal {

std::vector<std::int64_t> PicturesOf(const acquire::SessionReader& session,
                                     acquire::Target target,
                                     int channel,
                                     int pose) {
  std::vector<std::int64_t> numbers;
  for (std::int64_t k = 0; k < session.schedule().grid_begin(); ++k) {
    const acquire::ScheduledPicture& picture = session.schedule()[k];
    if (picture.target == target && (channel < 0 || picture.channel == channel) &&
        (pose < 0 || picture.pose == pose)) {
      numbers.push_back(k);
    }
  }
  return numbers;
}

double MeanCounts(const acquire::Frame& frame) {
  std::uint64_t sum = 0;
  for (const std::uint16_t count : frame.counts) {
    sum += count;
  }
  return static_cast<double>(sum) / static_cast<double>(frame.counts.size());
}

std::vector<bool> MaskOf(const std::vector<HotPixel>& pixels, std::size_t pixel_count) {
  std::vector<bool> mask;
  if (!pixels.empty()) {
    mask.resize(pixel_count, false);
    for (const HotPixel& pixel : pixels) {
      mask[static_cast<std::size_t>(pixel.index)] = true;
    }
  }
  return mask;
}

void FillHotPixels(const std::vector<HotPixel>& pixels,
                   int width,
                   int step,
                   std::vector<float>& picture) {
  const std::vector<bool> hot = MaskOf(pixels, picture.size());
  const int height = static_cast<int>(std::ssize(picture)) / width;
  for (const HotPixel& pixel : pixels) {
    const int x = pixel.index % width;
    const int y = pixel.index / width;
    float sum = 0;
    int count = 0;
    for (int dy = -step; dy <= step; dy += step) {
      for (int dx = -step; dx <= step; dx += step) {
        if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) {
          continue;
        }
        const auto k = static_cast<std::size_t>(std::int64_t{y + dy} * width + x + dx);
        if (!hot[k]) {
          sum += picture[k];
          ++count;
        }
      }
    }
    if (count > 0) {
      picture[static_cast<std::size_t>(pixel.index)] = sum / static_cast<float>(count);
    }
  }
}

}  // namespace nacre::calibrate::internal

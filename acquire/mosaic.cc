#include "acquire/mosaic.h"

#include "core/error.h"

#include <algorithm>

namespace nacre::acquire {
namespace {

void AverageTwoByTwo(Frame& frame) {
  const auto width = static_cast<std::size_t>(frame.width);
  const auto height = static_cast<std::size_t>(frame.height);
  for (std::size_t y = 0; y + 1 < height; ++y) {  // in place: looks right and down only
    std::uint16_t* row = &frame.counts[y * width];
    for (std::size_t x = 0; x + 1 < width; ++x) {
      const int sum = row[x] + row[x + 1] + row[x + width] + row[x + width + 1];
      row[x] = static_cast<std::uint16_t>((sum + 2) / 4);
    }
    row[width - 1] = row[width - 2];
  }
  const auto last = frame.counts.end() - frame.width;
  std::copy(last - frame.width, last, last);
}

void AverageColours(Frame& frame) {
  for (std::size_t k = 0; k < frame.counts.size() / 3; ++k) {
    const int sum =
        frame.counts[3 * k] + frame.counts[3 * k + 1] + frame.counts[3 * k + 2];
    frame.counts[k] = static_cast<std::uint16_t>((sum + 1) / 3);
  }
  frame.counts.resize(frame.counts.size() / 3);
}

}  // namespace

void MakeGrey(Frame& frame, const std::string& mosaic) {
  if (mosaic == "RGB") {
    AverageColours(frame);
  } else if (!mosaic.empty()) {
    Expect(frame.width >= 2 && frame.height >= 2, "a whole cell of the mosaic");
    AverageTwoByTwo(frame);
  }
}

}  // namespace nacre::acquire

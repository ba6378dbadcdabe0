#include "core/png.h"

#include "core/error.h"
#include "core/random.h"

#include <gtest/gtest.h>

namespace nacre {
namespace {

PngImage RandomImage(int channel_count, int bit_depth) {
  PngImage image{.width = 13,
                 .height = 11,
                 .channel_count = channel_count,
                 .bit_depth = bit_depth,
                 .values = {}};
  RandomStream random(7, static_cast<std::uint64_t>(channel_count * 100 + bit_depth));
  for (int i = 0; i < 13 * 11 * channel_count; ++i) {
    image.values.push_back(static_cast<std::uint16_t>(random() >> (32 - bit_depth)));
  }
  return image;
}

TEST(Png, RoundTripsEveryKind) {
  for (const int channels : {1, 2, 3, 4}) {
    for (const int depth : {8, 16}) {
      const PngImage image = RandomImage(channels, depth);
      const std::string bytes = EncodePng(image);
      const PngImage back = DecodePng(bytes, "test");
      EXPECT_EQ(back.width, 13);
      EXPECT_EQ(back.height, 11);
      EXPECT_EQ(back.channel_count, channels);
      EXPECT_EQ(back.bit_depth, depth);
      EXPECT_EQ(back.values, image.values);
    }
  }
}

TEST(Png, EveryTruncationOfThePixelsIsAnError) {
  const std::string bytes = EncodePng(RandomImage(3, 16));
  const std::size_t end_chunk = 12;  // IEND alone may be missing: the pixels are whole
  for (std::size_t size = 0; size < bytes.size() - end_chunk - 8; ++size) {
    EXPECT_THROW(DecodePng(std::span(bytes).first(size), "test"), Error) << size;
  }
}

TEST(Png, SrgbMatchesItsStandard) {
  EXPECT_EQ(SrgbFromLinear(0), 0);
  EXPECT_EQ(SrgbFromLinear(1), 255);
  EXPECT_EQ(SrgbFromLinear(0.18F), 118);
  EXPECT_EQ(SrgbFromLinear(-1), 0);
  for (int i = 0; i < 256; ++i) {
    EXPECT_EQ(SrgbFromLinear(LinearFromSrgb(static_cast<float>(i) / 255)), i);
  }
}

}  // namespace
}  // namespace nacre

#include "acquire/pixel_format.h"

#include "core/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace nacre::acquire {
namespace {

using ::testing::ElementsAre;

std::vector<std::uint16_t> Unpacked(const std::string& name,
                                    const std::vector<std::uint8_t>& bytes,
                                    std::size_t count) {
  std::vector<std::uint16_t> counts(count);
  Unpack(*FindPixelFormat(name), bytes, counts);
  return counts;
}

// The layouts as the GenICam Pixel Format Naming Convention draws them.
TEST(PixelFormatTest, UnpacksEveryLayout) {
  EXPECT_THAT(Unpacked("Mono8", {0x01, 0xFF}, 2), ElementsAre(0x01, 0xFF));
  EXPECT_THAT(Unpacked("Mono16", {0x34, 0x12, 0xFF, 0xFF}, 2),
              ElementsAre(0x1234, 0xFFFF));
  EXPECT_THAT(Unpacked("Mono12", {0xBC, 0x0A}, 1), ElementsAre(0xABC));
  // Low byte; high nibble of the first below the low nibble of the second; high byte.
  EXPECT_THAT(Unpacked("Mono12p", {0xBC, 0x3A, 0x12}, 2), ElementsAre(0xABC, 0x123));
  // High byte; low nibble of the first below that of the second; high byte.
  EXPECT_THAT(Unpacked("Mono12Packed", {0xAB, 0x3C, 0x12}, 2),
              ElementsAre(0xABC, 0x123));
}

TEST(PixelFormatTest, AnOddNumberOfPackedCountsEndsInHalfAByte) {
  EXPECT_EQ(FindPixelFormat("Mono12p")->ByteCount(3), 5U);
  EXPECT_THAT(Unpacked("Mono12p", {0xBC, 0x3A, 0x12, 0xEF, 0x0D}, 3),
              ElementsAre(0xABC, 0x123, 0xDEF));
  EXPECT_THAT(Unpacked("Mono12Packed", {0xAB, 0x3C, 0x12, 0xDE, 0x0F}, 3),
              ElementsAre(0xABC, 0x123, 0xDEF));
}

TEST(PixelFormatTest, KnowsItsNamesAndRefusesHalfAPicture) {
  EXPECT_EQ(FindPixelFormat("YUV422_8"), nullptr);
  EXPECT_THAT(PixelFormatNames(), ::testing::HasSubstr("Mono12p, Mono12Packed"));
  EXPECT_THROW(Unpacked("Mono16", {0, 0, 0}, 2), LogicError);
}

TEST(PixelFormatTest, CodesSayHowManyBitsAPixelTakes) {
  std::set<std::uint32_t> codes;
  for (const PixelFormat& format : PixelFormats()) {
    codes.insert(format.code);
    // Bits 16 to 23 of a code are the bits a pixel occupies, by the convention.
    EXPECT_EQ(
        format.ByteCount(800 * static_cast<std::size_t>(format.SamplesPerPixel())),
        100 * (format.code >> 16 & 0xFF))
        << format.name;
    EXPECT_EQ(format.name.starts_with("Bayer"), format.mosaic.size() == 4);
    if (format.mosaic.size() == 4) {
      EXPECT_EQ(format.name.substr(5, 2), format.mosaic.substr(0, 2));
    }
  }
  EXPECT_EQ(codes.size(), PixelFormats().size());
}

}  // namespace
}  // namespace nacre::acquire

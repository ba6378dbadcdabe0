#include "acquire/mono_format.h"

#include "core/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::acquire {
namespace {

using ::testing::ElementsAre;

std::vector<std::uint16_t> Unpacked(const std::string& name,
                                    const std::vector<std::uint8_t>& bytes,
                                    std::size_t count) {
  std::vector<std::uint16_t> counts(count);
  Unpack(*FindMonoFormat(name), bytes, counts);
  return counts;
}

// The layouts as the GenICam Pixel Format Naming Convention draws them.
TEST(MonoFormatTest, UnpacksEveryLayout) {
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

TEST(MonoFormatTest, AnOddNumberOfPackedCountsEndsInHalfAByte) {
  EXPECT_EQ(FindMonoFormat("Mono12p")->ByteCount(3), 5U);
  EXPECT_THAT(Unpacked("Mono12p", {0xBC, 0x3A, 0x12, 0xEF, 0x0D}, 3),
              ElementsAre(0xABC, 0x123, 0xDEF));
  EXPECT_THAT(Unpacked("Mono12Packed", {0xAB, 0x3C, 0x12, 0xDE, 0x0F}, 3),
              ElementsAre(0xABC, 0x123, 0xDEF));
}

TEST(MonoFormatTest, KnowsItsNamesAndRefusesHalfAPicture) {
  EXPECT_EQ(FindMonoFormat("BayerRG8"), nullptr);
  EXPECT_THAT(MonoFormatNames(), ::testing::HasSubstr("Mono12p, Mono12Packed"));
  EXPECT_THROW(Unpacked("Mono16", {0, 0, 0}, 2), LogicError);
}

}  // namespace
}  // namespace nacre::acquire

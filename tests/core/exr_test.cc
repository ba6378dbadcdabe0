#include "core/exr.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace nacre {
namespace {

ExrPart RandomPart(const std::string& name, std::uint64_t seed) {
  RandomStream random(seed, 0);
  ExrPart part{.name = name,
               .width = 7 + static_cast<int>(random.Uniform() * 20),
               .height = 5 + static_cast<int>(random.Uniform() * 20),
               .channels = {"R", "G", "B", "638nm"},
               .values = {},
               .attributes = {{"nacre.kind", "test"}}};
  part.values.resize(part.PixelCount() * part.channels.size());
  for (float& value : part.values) {
    value = random.UniformFloat();
  }
  return part;
}

TEST(Exr, KeepsEveryBitOfEveryPart) {
  const testing::TempFolder folder;
  const auto path = folder / "a.exr";
  const std::vector<ExrPart> written = {RandomPart("first", 1),
                                        RandomPart("second", 2)};
  WriteExr(path, written);
  const std::vector<ExrPart> read = ReadExr(path);
  ASSERT_EQ(read.size(), 2U);
  for (std::size_t p = 0; p < 2; ++p) {
    EXPECT_EQ(read[p].name, written[p].name);
    EXPECT_EQ(read[p].attributes.at("nacre.kind"), "test");
    ASSERT_EQ(read[p].channels, written[p].channels);
    EXPECT_EQ(read[p].values, written[p].values);
  }
  EXPECT_EQ(&FindPart(read, "second", path), &read[1]);
  EXPECT_THROW(FindPart(read, "third", path), Error);
}

TEST(Exr, SamePartsGiveTheSameBytes) {
  const testing::TempFolder folder;
  WriteExr(folder / "a.exr", {RandomPart("x", 3)});
  WriteExr(folder / "b.exr", {RandomPart("x", 3)});
  EXPECT_EQ(ReadFile(folder / "a.exr"), ReadFile(folder / "b.exr"));
}

TEST(Exr, EveryTruncationIsAnError) {
  const testing::TempFolder folder;
  WriteExr(folder / "a.exr", {RandomPart("x", 4)});
  const std::string bytes = ReadFile(folder / "a.exr");
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 97) {
    WriteFile(folder / "cut.exr", bytes.substr(0, size));
    EXPECT_THROW(ReadExr(folder / "cut.exr"), Error) << size << " bytes";
  }
}

TEST(Exr, WholeNumbersAndHalvesComeBackAndAreSmaller) {
  const testing::TempFolder folder;
  ExrPart part = RandomPart("x", 6);
  part.width = part.height = 64;
  part.values.clear();
  RandomStream random(2, 0);
  for (std::size_t n = 0; n < 4 * part.PixelCount(); ++n) {
    part.values.push_back(std::floor(900 +
                                     800 * std::sin(0.01F * static_cast<float>(n)) +
                                     20 * random.UniformFloat()));
  }
  std::int64_t floats = 0;
  for (const ExrPixels pixels :
       {ExrPixels::kFloat, ExrPixels::kHalf, ExrPixels::kCodes}) {
    part.pixels = pixels;
    WriteExr(folder / "a.exr", {part});
    EXPECT_EQ(ReadExr(folder / "a.exr")[0].values, part.values);
    const std::int64_t bytes = ExrFileBytes({part});
    EXPECT_EQ(bytes,
              static_cast<std::int64_t>(std::filesystem::file_size(folder / "a.exr")));
    floats = pixels == ExrPixels::kFloat ? bytes : floats;
    if (pixels != ExrPixels::kFloat) {
      EXPECT_LT(bytes, floats);
    }
  }
  part.values[0] = 0.5F;
  EXPECT_THROW(WriteExr(folder / "a.exr", {part}), std::exception);
}

TEST(Exr, RefusesMoreThanTheMemoryAllowed) {
  const testing::TempFolder folder;
  WriteExr(folder / "a.exr", {RandomPart("x", 5)});
  EXPECT_THROW(ReadExr(folder / "a.exr", 100), Error);
}

}  // namespace
}  // namespace nacre

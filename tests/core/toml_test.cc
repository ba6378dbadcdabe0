#include "core/toml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace nacre {
namespace {

const char* const kText = R"(name = "slab"
thickness_mm = "inf"
sigma = [1.0, 2]
flag = true
[grid]
points = 64
[[medium]]
g = 0.5
[[medium]]
g = 0.75
)";

void ExpectError(const std::function<void()>& body, const std::string& message) {
  try {
    body();
    FAIL() << "expected: " << message;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), ::testing::HasSubstr(message));
  }
}

TEST(Toml, ReadsWhatIsThere) {
  const TomlTable table = TomlTable::FromText(kText, "a.toml");
  EXPECT_EQ(table.Text("name"), "slab");
  EXPECT_EQ(table.Number("thickness_mm"), HUGE_VAL);
  EXPECT_EQ(table.Numbers("sigma"), (std::vector<double>{1, 2}));
  EXPECT_TRUE(table.Boolean("flag", false));
  EXPECT_EQ(table.Table("grid").Integer("points"), 64);
  EXPECT_EQ(table.Tables("medium").at(1).Number("g"), 0.75);
  EXPECT_EQ(table.Number("absent", 3.5), 3.5);
  EXPECT_FALSE(table.FindTable("absent").has_value());
  table.RejectUnknownKeys();
}

TEST(Toml, ErrorsNameFileAndLine) {
  const TomlTable table = TomlTable::FromText(kText, "a.toml");
  ExpectError([&] { (void)table.Number("name"); }, "a.toml:1: name: expected a number");
  ExpectError([&] { (void)table.Number("missing"); }, "missing missing");
  ExpectError(
      [&] {
        (void)table.Numbers("sigma", Range{0, 1.5});
      },
      "2 is outside [0, 1.5]");
  ExpectError([&] { (void)table.Table("grid").Text("points"); },
              "a.toml:6: grid.points");
  ExpectError([&] { (void)table.Tables("medium").at(1).Integer("g"); },
              "a.toml:10: medium[1].g: 0.75 is not a whole number");
  ExpectError([&] { (void)TomlTable::FromText("a = \nb = 1", "b.toml"); }, "b.toml:");
}

TEST(Toml, UnknownKeysAreErrors) {
  const TomlTable table = TomlTable::FromText("pitch_mm = 1\npich_mm = 2\n", "a.toml");
  (void)table.Number("pitch_mm");
  ExpectError([&] { table.RejectUnknownKeys(); },
              "a.toml:2: pich_mm: unknown here; known are: pitch_mm");
}

}  // namespace
}  // namespace nacre

#include "rigs/phantom.h"

#include "core/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace nacre::rigs {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Line numbers matter to the tests of errors.
const std::string kGood =
    "[slab]\n"
    "thickness_mm = 10.0\n"
    "eta = 1.5\n"
    "bottom = \"air\"\n"
    "[[medium]]\n"
    "name = \"A\"\n"
    "sigma_a_per_mm = [0.0021, 0.0041, 0.0071]\n"
    "sigma_s_per_mm = [2.19, 2.62, 3.00]\n"
    "g = 0.0\n"
    "[[medium]]\n"
    "name = \"B\"\n"
    "sigma_a_per_mm = 0.05\n"
    "sigma_s_per_mm = [5.0, 5.5, 6.0]\n"
    "g = 0.8\n"
    "[pattern]\n"
    "type = \"chessboard\"\n"
    "cell_mm = 1.5\n"
    "[beam]\n"
    "shape = \"gaussian\"\n"
    "width_mm = 0.4\n"
    "angle_deg = 30\n"
    "[grid]\n"
    "points = [64, 48]\n"
    "pitch_mm = 0.25\n"
    "core = 39\n";

std::string With(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Phantom, ReadsEverything) {
  const Phantom phantom = ParsePhantom(kGood, "p.toml");
  EXPECT_THAT(phantom.channels, ElementsAre("R", "G", "B"));
  EXPECT_EQ(phantom.slab.thickness_mm, 10);
  EXPECT_EQ(phantom.slab.eta, 1.5);
  EXPECT_EQ(phantom.slab.bottom, Bottom::kAir);
  ASSERT_EQ(phantom.media.size(), 2u);
  EXPECT_EQ(phantom.media[0].name, "A");
  EXPECT_THAT(phantom.media[1].sigma_a_per_mm, ElementsAre(0.05, 0.05, 0.05));
  EXPECT_NEAR(phantom.media[1].ReducedScattering(2), 1.2, 1e-12);
  EXPECT_EQ(phantom.pattern.type, PatternType::kChessboard);
  EXPECT_EQ(phantom.pattern.cell_mm, 1.5);
  EXPECT_EQ(phantom.beam.shape, BeamShape::kGaussian);
  EXPECT_EQ(phantom.beam.width_mm, 0.4);
  EXPECT_NEAR(phantom.beam.angle_rad, std::numbers::pi / 6, 1e-12);
  EXPECT_EQ(phantom.grid.points_x, 64);
  EXPECT_EQ(phantom.grid.points_y, 48);
  EXPECT_EQ(phantom.grid.pitch_mm, 0.25);
  EXPECT_EQ(phantom.grid.core, 39);
}

TEST(Phantom, DefaultsAreTheSimplest) {
  const Phantom phantom = ParsePhantom(
      "[slab]\nthickness_mm = \"inf\"\neta = 1.3\n"
      "[[medium]]\nsigma_a_per_mm = 0.1\nsigma_s_per_mm = 2\n",
      "p.toml");
  EXPECT_TRUE(std::isinf(phantom.slab.thickness_mm));
  EXPECT_EQ(phantom.slab.bottom, Bottom::kAir);
  EXPECT_THAT(phantom.channels, ElementsAre("c1"));
  EXPECT_EQ(phantom.pattern.type, PatternType::kHomogeneous);
  EXPECT_EQ(phantom.beam.shape, BeamShape::kPencil);
  EXPECT_EQ(phantom.grid.points_x, 0);
}

TEST(Phantom, NamesItsOwnChannels) {
  const Phantom phantom = ParsePhantom(
      "channels = [\"638nm\", \"520nm\"]\n[slab]\nthickness_mm = inf\neta = 1.3\n"
      "[[medium]]\nsigma_a_per_mm = [0.1, 0.2]\nsigma_s_per_mm = 2\n",
      "p.toml");
  EXPECT_THAT(phantom.channels, ElementsAre("638nm", "520nm"));
}

struct BadLine {
  const char* from;
  const char* to;
  const char* message;
};

class BadPhantom : public ::testing::TestWithParam<BadLine> {};

TEST_P(BadPhantom, IsRefusedWithFileAndLine) {
  const BadLine& bad = GetParam();
  try {
    ParsePhantom(With(bad.from, bad.to), "p.toml");
    FAIL() << bad.message;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), HasSubstr(bad.message));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Phantom,
    BadPhantom,
    ::testing::Values(
        BadLine{"thickness_mm = 10.0",
                "thickness_mm = -1",
                "p.toml:2: slab.thickness_mm: -1 is"},
        BadLine{"eta = 1.5", "eta = 0.5", "p.toml:3: slab.eta: 0.5 is outside"},
        BadLine{"eta = 1.5", "", "missing slab.eta"},
        BadLine{"\"air\"",
                "\"glass\"",
                "p.toml:4: slab.bottom: 'glass' is not known; known are: air, matched"},
        BadLine{"[0.0021, 0.0041, 0.0071]",
                "[0.0021, 0.0041]",
                "p.toml:7: medium[0].sigma_a_per_mm: 2 values for 3 channels"},
        BadLine{
            "2.19", "-2.19", "p.toml:8: medium[0].sigma_s_per_mm: -2.19 is outside"},
        BadLine{"2.19", "nan", "p.toml:8: medium[0].sigma_s_per_mm: nan is outside"},
        BadLine{"g = 0.8", "g = 1.0", "p.toml:14: medium[1].g: 1 is outside"},
        BadLine{"g = 0.8", "gee = 1.0", "p.toml:14: medium[1].gee: unknown here"},
        BadLine{"\"chessboard\"",
                "\"go board\"",
                "p.toml:16: pattern.type: 'go board' is not known"},
        BadLine{"\"chessboard\"\ncell_mm = 1.5",
                "\"homogeneous\"",
                "medium: 2 given, but the pattern 'homogeneous' is made of 1"},
        BadLine{
            "cell_mm = 1.5", "cell_mm = 0", "p.toml:17: pattern.cell_mm: 0 is outside"},
        BadLine{
            "\"gaussian\"", "\"star\"", "p.toml:19: beam.shape: 'star' is not known"},
        BadLine{
            "[64, 48]", "[64]", "p.toml:23: grid.points: expected two whole numbers"},
        BadLine{"[64, 48]",
                "[64, 4.5]",
                "p.toml:23: grid.points: expected two whole numbers"},
        BadLine{"core = 39", "core = 40", "p.toml:25: grid.core: 40 is even"},
        BadLine{"[slab]", "shannels = 3\n[slab]", "p.toml:1: shannels: unknown here"},
        BadLine{"[slab]",
                "channels = [\"R\", \"R\", \"B\"]\n[slab]",
                "p.toml:1: channels: expected different"},
        BadLine{"[slab]", "[slab", "p.toml:1:"}));

TEST(Phantom, MissingMediaAndFilesAreRefused) {
  EXPECT_THAT([] { ParsePhantom("[slab]\nthickness_mm = 1\neta = 1.3\n", "p.toml"); },
              ::testing::ThrowsMessage<Error>(HasSubstr("p.toml:1: medium: missing")));
  EXPECT_THROW(ReadPhantom("/nonexistent/p.toml"), Error);
}

TEST(Phantom, TheShippedOnesAreGood) {
  for (const char* name :
       {"chessboard4x4.toml", "chessboard4x4-quick.toml", "stripes.toml"}) {
    const Phantom phantom = ReadPhantom(std::string(NACRE_RIGS_FOLDER) + "/" + name);
    EXPECT_EQ(phantom.channels.size(), 3u) << name;
  }
}

}  // namespace
}  // namespace nacre::rigs

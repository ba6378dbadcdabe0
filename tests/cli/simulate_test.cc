// nacre simulate by Monte Carlo and diffusion: the flags, keys and files that other
// programs rely on.
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "reconstruct/rd_dataset.h"
#include "tests/cli/command.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

namespace nacre::cli {
namespace {

using ::testing::HasSubstr;
using testing::RunJson;
using ::testing::ThrowsMessage;

constexpr const char* kBoard = R"(
channels = ["R", "B"]
[slab]
thickness_mm = 10.0
eta = 1.5
[[medium]]
name = "A"
sigma_a_per_mm = [0.0021, 0.0071]
sigma_s_per_mm = [2.19, 3.0]
[[medium]]
name = "B"
sigma_a_per_mm = [0.05, 0.05]
sigma_s_per_mm = [1.0, 1.0]
[pattern]
type = "chessboard"
cell_mm = 1.5
[grid]
points = [6, 4]
pitch_mm = 0.5
core = 5
)";

// Adding-doubling's row M17 per unit flux that entered.
constexpr const char* kSlab = R"(
channels = ["Y"]
[slab]
thickness_mm = 1.0
eta = 1.37
[[medium]]
name = "only"
sigma_a_per_mm = [0.2]
sigma_s_per_mm = [9.8]
g = 0.8
[pattern]
type = "homogeneous"
)";

class Simulate : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteFile(folder_ / "board.toml", kBoard);
    WriteFile(folder_ / "slab.toml", kSlab);
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  Json Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "simulate");
    return RunJson(arguments);
  }
  int Code(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"simulate", Path("board.toml"), "--quiet"});
    std::ostringstream out;
    ::testing::internal::CaptureStderr();
    const int code = RunCommand(arguments, out);
    ::testing::internal::GetCapturedStderr();
    return code;
  }

  testing::TempFolder folder_;
};

TEST_F(Simulate, TotalsOfASlabAreAddingDoublings) {
  const Json json =
      Run({Path("slab.toml"), "--totals", "--solver", "mc", "--photons", "2e5"});
  const Json& channel = json.at("channels").at(0);
  const double specular = json.at("specular");
  EXPECT_NEAR(specular, 0.024373, 1e-6);
  const double r = channel.at("R");
  const double r_se = channel.at("R_se");
  const double t = channel.at("T");
  const double t_se = channel.at("T_se");
  const double a = channel.at("A");
  EXPECT_NEAR(r, (0.277173 - specular) / (1 - specular), 4 * r_se);
  EXPECT_NEAR(t, 0.267808 / (1 - specular), 4 * t_se);
  EXPECT_NEAR(r_se, std::sqrt(r * (1 - r) / 2e5), 1e-9);
  EXPECT_NEAR(r + t + a, 1, 1e-12);
  EXPECT_EQ(channel.at("photons"), 200'000);
  EXPECT_EQ(json.at("solver"), "mc");
  EXPECT_GT(json.at("cpu_seconds"), 0);
}

TEST_F(Simulate, TotalsResolveAnglesAndDepths) {
  const Json json = Run({Path("slab.toml"),
                         "--totals",
                         "--solver",
                         "mc",
                         "--photons",
                         "20000",
                         "--cosines",
                         "4",
                         "--depths",
                         "10",
                         "--depth-step",
                         "0.1"});
  const Json& channel = json.at("channels").at(0);
  const auto sum = [&](const char* table) {
    double total = 0;
    for (const Json& value : channel.at(table).at("mean")) {
      total += value.get<double>();
    }
    return total;
  };
  EXPECT_NEAR(sum("reflected_in_cosine"), channel.at("R").get<double>(), 1e-12);
  EXPECT_NEAR(sum("transmitted_in_cosine"), channel.at("T").get<double>(), 1e-12);
  EXPECT_NEAR(sum("absorbed_in_depth"), channel.at("A").get<double>(), 1e-12);
}

TEST_F(Simulate, ASliceHasItsStandardErrorsBesideIt) {
  const std::string out = Path("slice.exr");
  const Json json = Run({Path("board.toml"),
                         "--beam",
                         "0.75,0.75",
                         "--solver",
                         "mc",
                         "--photons",
                         "50000",
                         "--out",
                         out});
  const std::vector<ExrPart> parts = ReadExr(out);
  const ExrPart& rd = FindPart(parts, "rd", out);
  const ExrPart& se = FindPart(parts, "stderr", out);
  EXPECT_EQ(rd.channels, (std::vector<std::string>{"R", "B"}));
  EXPECT_EQ(rd.width, 5);
  EXPECT_EQ(se.height, 5);
  double sum = 0;
  const auto red = static_cast<std::size_t>(rd.FindChannel("R"));
  for (std::size_t k = 0; k < rd.PixelCount(); ++k) {
    const auto value = static_cast<double>(rd.Channel(red)[k]);
    const auto error = static_cast<double>(se.Channel(red)[k]);
    sum += value * 0.25;
    EXPECT_GT(error, 0);
    EXPECT_LE(error, 1.01 * std::sqrt(value / 0.25 / 5e4) + 1e-9);
  }
  EXPECT_NEAR(sum, json.at("window_totals").at(0).get<double>(), 1e-6);
  // The same seed, the same file.
  const std::string first = ReadFile(out);
  Run({Path("board.toml"),
       "--beam",
       "0.75,0.75",
       "--solver",
       "mc",
       "--photons",
       "50000",
       "--out",
       out,
       "--threads",
       "1"});
  EXPECT_EQ(ReadFile(out), first);
  Run({Path("board.toml"),
       "--beam",
       "0.75,0.75",
       "--solver",
       "mc",
       "--photons",
       "50000",
       "--out",
       out,
       "--seed",
       "2"});
  EXPECT_NE(ReadFile(out), first);
}

TEST_F(Simulate, DatasetsSolveWhatDiffers) {
  for (const std::string solver : {"mc", "diffusion"}) {
    const std::string out = Path(solver + ".rd.exr");
    std::vector<std::string> arguments{
        Path("board.toml"), "--solver", solver, "--out", out};
    if (solver == "mc") {
      arguments.insert(arguments.end(), {"--error", "0.05"});
    }
    const Json json = Run(arguments);
    EXPECT_EQ(json.at("solver"), solver);
    EXPECT_LT(json.at("distinct_points"), 24);
    EXPECT_LE(json.at("noise"), 0.05);
    const reconstruct::RdDataset dataset = reconstruct::ReadDataset(out);
    EXPECT_EQ(dataset.header.PointCount(), 24);
    for (const float value : dataset.rd) {
      EXPECT_GT(value, 0);
    }
  }
}

TEST_F(Simulate, AutoSaysWhatItTookAndWhy) {
  const Json rough = Run({Path("board.toml"), "--totals"});
  EXPECT_EQ(rough.at("solver"), "fast");
  EXPECT_THAT(rough.at("why").get<std::string>(), HasSubstr("cheapest"));
  const Json fine = Run({Path("board.toml"), "--totals", "--error", "0.01"});
  EXPECT_EQ(fine.at("solver"), "mc");
  const Json& channel = fine.at("channels").at(0);
  EXPECT_LE(channel.at("R_se").get<double>(), 0.01 * channel.at("R").get<double>());
  EXPECT_LE(channel.at("T_se").get<double>(), 0.01 * channel.at("T").get<double>());
}

TEST_F(Simulate, APhotoHasItsStandardErrorsToo) {
  ExrPart light;
  light.width = 12;
  light.height = 8;
  light.channels = {"R", "B"};
  light.values.assign(192, 1.0F);
  WriteExr(folder_ / "light.exr", {light});
  const std::string out = Path("photo.exr");
  Run({Path("board.toml"),
       "--photo",
       Path("light.exr"),
       "--solver",
       "mc",
       "--photons",
       "20000",
       "--out",
       out});
  const std::vector<ExrPart> parts = ReadExr(out);
  const ExrPart& photo = FindPart(parts, "exitance", out);
  EXPECT_EQ(photo.width, 12);
  EXPECT_EQ(FindPart(parts, "stderr", out).height, 8);
  for (const float value : photo.values) {
    EXPECT_GT(value, 0);
    EXPECT_LT(value, 1);
  }
}

TEST_F(Simulate, RefusesWhatMakesNoSense) {
  const std::string out = Path("x.exr");
  const std::vector<std::vector<std::string>> usage{
      {"--out", out, "--beam", "0"},
      {"--out", out, "--photons", "-5"},
      {"--out", out, "--photons", "0"},
      {"--out", out, "--photons", "1.5"},
      {"--out", out, "--photons", "1e30"},
      {"--out", out, "--photons", "many"},
      {"--out", out, "--error", "-1"},
      {"--out", out, "--error", "0"},
  };
  for (const auto& arguments : usage) {
    EXPECT_EQ(Code(arguments), static_cast<int>(ExitCode::kUsage))
        << ::testing::PrintToString(arguments);
  }
  const auto message = [&](std::vector<std::string> arguments, const char* expected) {
    EXPECT_THAT([&] { Code(arguments); }, ThrowsMessage<Error>(HasSubstr(expected)));
    ::testing::internal::GetCapturedStderr();
  };
  message({"--solver", "mc"}, "--out FILE is needed");
  message({"--out", out, "--beam", "nan,0"}, "not a position");
  message({"--out", out, "--beam", "0,inf"}, "not a position");
  message({"--out", out, "--error", "nan"}, "option error is nan");
  message({"--out", out, "--solver", "magic"}, "there are: auto, fast");
  message({"--out", out, "--solver", "fast", "--photons", "9"}, "is deterministic");
  message({"--totals", "--solver", "fast", "--cosines", "3"}, "need --solver mc");
  message({"--totals", "--solver", "mc", "--depths", "3"}, "go together");
  message({"--out", out, "--cosines", "3"}, "go with --totals");
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace nacre::cli

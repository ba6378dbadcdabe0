#include "acquire/rig.h"

#include "tests/acquire/fake_rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::acquire {
namespace {

using ::testing::HasSubstr;
using testing::RigToml;
using testing::TestRig;

std::string ErrorOf(const std::string& from, const std::string& to) {
  try {
    TestRig({{from, to}});
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST(Rig, ReadsEveryField) {
  const RigDescription rig = TestRig();
  EXPECT_EQ(rig.kind, "simulated");
  EXPECT_EQ(rig.sample.name, "test sample");
  EXPECT_EQ(rig.sample.eta, 1.5);
  EXPECT_EQ(rig.grid.points_x, 7);
  EXPECT_EQ(rig.grid.points_y, 5);
  EXPECT_EQ(rig.grid.pitch_mm, 0.5);
  EXPECT_EQ(rig.grid.core, 3);
  EXPECT_THAT(rig.camera.exposures_us, ::testing::ElementsAre(8000, 1000));
  EXPECT_EQ(rig.camera.dark_frames, 2);
  EXPECT_EQ(rig.camera.target_exposure_us, 2000);
  EXPECT_THAT(rig.camera.flat_exposures_us, ::testing::ElementsAre(500, 1500));
  EXPECT_EQ(rig.targets.checkerboard_columns, 8);
  EXPECT_EQ(rig.targets.checkerboard_rows, 5);
  EXPECT_EQ(rig.targets.checkerboard_square_mm, 2);
  EXPECT_EQ(rig.targets.checkerboard_poses, 3);
  EXPECT_EQ(rig.targets.reference_reflectance, 0.99);
  EXPECT_EQ(rig.targets.reference_exposure_us, 4000);
  EXPECT_EQ(rig.targets.reference_frames, 1);
  EXPECT_EQ(rig.targets.laser_lattice, 5);
  EXPECT_EQ(rig.scanner.mm_per_rad, 300);
  EXPECT_THAT(rig.scanner.channels, ::testing::ElementsAre("R", "G"));
  EXPECT_EQ(rig.schedule.spot_spacing_cells, 4);
  EXPECT_EQ(rig.text, RigToml());
  EXPECT_EQ(rig.hash.size(), 32U);
}

TEST(Rig, DefaultsOfScannerAndSchedule) {
  const RigDescription rig = TestRig({{"channels = [\"R\", \"G\"]\n", ""},
                                      {"spot_spacing_cells = 4\n", ""},
                                      {"reference_frames = 1\n", ""}});
  EXPECT_EQ(rig.targets.reference_frames, 4);
  EXPECT_THAT(rig.scanner.channels, ::testing::ElementsAre("R", "G", "B"));
  EXPECT_EQ(rig.schedule.spot_spacing_cells, 5);  // ceil(1.4 * 3)
  EXPECT_EQ(rig.schedule.order_seed, 0U);
}

TEST(Rig, GridPointsRunFromTheUpperLeft) {
  const GridDescription grid = TestRig().grid;
  EXPECT_EQ(grid.Point(0, 0), (PointMm{-1.5, 1}));
  EXPECT_EQ(grid.Point(6, 4), (PointMm{1.5, -1}));
  EXPECT_EQ(grid.HalfWidthMm(), 2.25);
  EXPECT_EQ(grid.HalfHeightMm(), 1.75);
}

TEST(Rig, LeavesTheSimulatedTableToTheSimulator) {
  EXPECT_NO_THROW(
      acquire::ParseRig(RigToml() + "\n[simulated]\nwhatever = 1\n", "rig.toml"));
}

TEST(Rig, UnknownKindIsADeviceError) {
  try {
    TestRig({{"\"simulated\"", "\"aravis\""}});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kDevice);
    EXPECT_THAT(e.what(),
                HasSubstr("rig.toml:1: kind: this build has no driver for "
                          "'aravis'"));
  }
}

#ifdef NACRE_HAS_ARAVIS
// A rig of kind "hardware" with these lines in [camera.device].
acquire::RigDescription HardwareRig(const std::string& device) {
  return TestRig({{"\"simulated\"", "\"hardware\""},
                  {"[targets]", "[camera.device]\n" + device + "\n[targets]"}});
}

TEST(Rig, ReadsACamerasSettings) {
  const auto device = HardwareRig(R"(id = "192.168.1.20"
pixel_format = "Mono12p"
trigger = "Line1"
gain = 2.5
region = [16, 8, 640, 480]
packet_size_bytes = 9000
socket_buffer_bytes = 8000000
reconnect_s = 5)")
                          .camera.device;
  ASSERT_TRUE(device);
  EXPECT_EQ(device->id, "192.168.1.20");
  EXPECT_EQ(device->pixel_format, "Mono12p");
  EXPECT_EQ(device->trigger, "Line1");
  EXPECT_EQ(device->gain, 2.5);
  EXPECT_EQ(device->region->x, 16);
  EXPECT_EQ(device->region->height, 480);
  EXPECT_EQ(device->packet_size_bytes, 9000);
  EXPECT_EQ(device->socket_buffer_bytes, 8000000);
  EXPECT_EQ(device->reconnect_s, 5);
  EXPECT_FALSE(TestRig().camera.device);
}

TEST(Rig, SaysWhatIsWrongWithACamerasSettings) {
  const auto message = [](const std::string& lines) {
    try {
      HardwareRig(lines);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message("gain = 1"), HasSubstr("missing camera.device.id"));
  EXPECT_THAT(message("id = ''"), HasSubstr("`nacre doctor` lists"));
  EXPECT_THAT(message("id = 'a'\npixel_format = 'YUV8'"),
              HasSubstr("'YUV8' isn't one of Mono8, Mono10"));
  EXPECT_THAT(message("id = 'a'\nregion = [0, 0, 10]"),
              HasSubstr("[x, y, width, height]"));
  EXPECT_THAT(message("id = 'a'\npacket_size_bytes = 100"),
              HasSubstr("100 is outside"));
  EXPECT_THAT(message("id = 'a'\nshutter = 1"),
              HasSubstr("camera.device.shutter: unknown here"));
}
#endif

struct BadRig {
  const char* from;
  const char* to;
  const char* message;
};

class RigErrors : public ::testing::TestWithParam<BadRig> {};

TEST_P(RigErrors, NameTheLineAndTheKey) {
  EXPECT_THAT(ErrorOf(GetParam().from, GetParam().to), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    All,
    RigErrors,
    ::testing::Values(
        BadRig{"core = 3", "core = 4", "rig.toml:10: grid.core: 4 is even"},
        BadRig{
            "points = [7, 5]", "points = [7]", "rig.toml:8: grid.points: expected two"},
        BadRig{"points = [7, 5]", "points = [7.5, 5]", "expected two whole numbers"},
        BadRig{"points = [7, 5]", "points = [0, 5]", "0 is outside"},
        BadRig{"pitch_mm = 0.5", "pitch_mm = nan", "grid.pitch_mm: nan is outside"},
        BadRig{"pitch_mm", "pitch", "missing grid.pitch_mm"},
        BadRig{"eta = 1.5", "eta = 1.5\ncolour = 1", "sample.colour: unknown here"},
        BadRig{"eta = 1.5", "eta = 0.5", "sample.eta: 0.5 is outside"},
        BadRig{"\"test sample\"", "\"\"", "sample.name: is empty"},
        BadRig{"[8000, 1000]", "[1000, 8000]", "from the longest to the shortest"},
        BadRig{"[8000, 1000]", "[8000, 8000]", "given twice"},
        BadRig{"[8000, 1000]", "[]", "at least one exposure"},
        BadRig{"[8000, 1000]", "[8000, -1]", "-1 is outside"},
        BadRig{"[500, 1500]", "[500]", "at least two exposures"},
        BadRig{"dark_frames = 2", "dark_frames = 1", "1 is outside"},
        BadRig{"checkerboard_rows = 5", "checkerboard_rows = 8", "must differ"},
        BadRig{"checkerboard_poses = 3", "checkerboard_poses = 2", "2 is outside"},
        BadRig{"laser_lattice = 5", "laser_lattice = 4", "4 is outside"},
        BadRig{"reflectance = 0.99", "reflectance = 1.5", "1.5 is outside"},
        BadRig{"[\"R\", \"G\"]", "[\"R\", \"R\"]", "different, non-empty"},
        BadRig{"mm_per_rad = 300", "mm_per_rad = true", "expected a number"},
        BadRig{"spacing_cells = 4",
               "spacing_cells = 1",
               "1 is less than 2: spots would light"},
        BadRig{"[schedule]", "[plan]", "rig.toml:32: plan: unknown here"},
        BadRig{"kind = ", "kind ", "rig.toml:1:"}));

}  // namespace
}  // namespace nacre::acquire

#include "rigs/simulated_rig.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "rigs/checkerboard.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <string>

namespace nacre::rigs {
namespace {

using acquire::Frame;
using acquire::ScanAngle;
using acquire::Target;
using nacre::testing::TempFolder;
using ::testing::HasSubstr;

const std::string kPhantom =
    "[slab]\nthickness_mm = 10\neta = 1.5\n"
    "[[medium]]\nsigma_a_per_mm = [0.02, 0.02, 0.02]\nsigma_s_per_mm = 2\n";

const std::string kRig =
    "kind = \"simulated\"\n"
    "[sample]\nname = \"test\"\neta = 1.5\n"
    "[grid]\npoints = [4, 4]\npitch_mm = 2\ncore = 5\n"
    "[camera]\nexposures_us = [20000, 1000]\ndark_frames = 2\n"
    "target_exposure_us = 5000\nflat_exposures_us = [1000, 5000]\n"
    "[targets]\ncheckerboard_columns = 6\ncheckerboard_rows = 5\n"
    "checkerboard_square_mm = 3\ncheckerboard_poses = 5\n"
    "reference_reflectance = 0.99\nreference_exposure_us = 100\nlaser_lattice = 5\n"
    "[scanner]\nmm_per_rad = 400\n"
    "[simulated]\nphantom = \"phantom.toml\"\nseed = 4\n"
    "[simulated.camera]\nwidth_px = 120\nheight_px = 110\nfield_mm = 36\n"
    "electrons_per_us_per_radiance = 7\n"
    "[simulated.laser]\npower_mw = [10, 8, 6]\n";

class SimulatedRigTest : public ::testing::Test {
 protected:
  SimulatedRigTest() {
    WriteFile(folder_ / "phantom.toml", kPhantom);
    WriteFile(path(), kRig);
  }
  std::filesystem::path path() const { return folder_ / "rig.toml"; }

  void Rewrite(const std::string& from, const std::string& to) {
    std::string text = kRig;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    WriteFile(path(), text.replace(at, from.size(), to));
  }

  TempFolder folder_;
};

std::vector<std::uint16_t> Picture(SimulatedRig& rig,
                                   std::uint64_t number,
                                   double exposure_us = 1000) {
  rig.camera().SetExposureUs(exposure_us);
  return rig.camera().Capture(number, std::chrono::milliseconds(100)).value().counts;
}

double Mean(const std::vector<std::uint16_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), 0.0) /
         static_cast<double>(counts.size());
}

TEST_F(SimulatedRigTest, TellsWhatItIs) {
  SimulatedRig rig(path());
  const acquire::CameraInfo info = rig.camera().Info();
  EXPECT_EQ(info.width, 120);
  EXPECT_EQ(info.height, 110);
  EXPECT_EQ(info.bit_depth, 12);
  EXPECT_THAT(rig.illuminator().Info().channels, ::testing::ElementsAre("R", "G", "B"));
  EXPECT_EQ(rig.description().targets.checkerboard_columns, 6);
  EXPECT_EQ(rig.phantom().media.size(), 1u);
  EXPECT_EQ(rig.phantom_path().filename(), "phantom.toml");
}

TEST_F(SimulatedRigTest, PicturesAreRepeatable) {
  SimulatedRig rig(path(), {.thread_count = 1});
  SimulatedRig twin(path(), {.thread_count = 3});
  const std::array spots = {ScanAngle{0, 0}, ScanAngle{0.01, -0.008}};
  for (SimulatedRig* each : {&rig, &twin}) {
    each->stage().Place(Target::kSample, 0);
    each->illuminator().Light(spots, 1);
  }
  const auto first = Picture(rig, 12);
  EXPECT_NE(Picture(rig, 13), first);
  EXPECT_EQ(Picture(rig, 12), first);
  EXPECT_EQ(Picture(twin, 12), first);
}

TEST_F(SimulatedRigTest, TheSeedCanBeGiven) {
  SimulatedRig as_written(path());
  SimulatedRig same(path(), {.seed = 4});
  SimulatedRig other(path(), {.seed = 5});
  const auto picture = Picture(as_written, 1);
  EXPECT_EQ(Picture(same, 1), picture);
  EXPECT_NE(Picture(other, 1), picture);
}

TEST_F(SimulatedRigTest, EachTargetIsSeen) {
  SimulatedRig rig(path());
  const std::array spots = {ScanAngle{0, 0}};
  rig.illuminator().Light(spots, 0);
  rig.stage().Place(Target::kNothing, 0);
  const double dark = Mean(Picture(rig, 0, 10000));
  EXPECT_NEAR(dark, 64, 0.5) << "the lens cap must keep the laser out";
  rig.illuminator().Blank();
  rig.stage().Place(Target::kSample, 0);
  EXPECT_NEAR(Mean(Picture(rig, 1, 10000)), dark, 0.1) << "no lamp over the sample";

  rig.stage().Place(Target::kFlat, 0);
  const auto flat = Picture(rig, 2, 10000);
  EXPECT_NEAR(Mean(flat), 64 + 10000 * 0.9 / 6, 2);
  rig.stage().Place(Target::kCheckerboard, 0);
  const auto board = Picture(rig, 3, 10000);
  rig.stage().Place(Target::kCheckerboard, 1);
  EXPECT_NE(Picture(rig, 3, 10000), board);

  rig.stage().Place(Target::kReference, 0);
  rig.illuminator().Light(spots, 0);
  const auto reference = Picture(rig, 4, 100);
  rig.stage().Place(Target::kSample, 0);
  const auto sample = Picture(rig, 5, 100);
  // All of the light comes back from one small spot, or some of it from all around.
  EXPECT_GT(*std::max_element(reference.begin(), reference.end()),
            5 * *std::max_element(sample.begin(), sample.end()) - 4 * 64);
}

// The cache of what is seen must not outlive a change.
TEST_F(SimulatedRigTest, ChangesOfLightAreSeenAtOnce) {
  SimulatedRig rig(path());
  rig.stage().Place(Target::kSample, 0);
  const std::array here = {ScanAngle{0, 0}};
  const std::array there = {ScanAngle{0.02, 0.02}};
  rig.illuminator().Light(here, 0);
  const auto first = Picture(rig, 7);
  rig.illuminator().Light(there, 0);
  const auto second = Picture(rig, 7);
  EXPECT_NE(second, first);
  rig.illuminator().Light(there, 2);
  EXPECT_NE(Picture(rig, 7), second);
  rig.illuminator().Light(here, 0);
  EXPECT_EQ(Picture(rig, 7), first);
}

TEST_F(SimulatedRigTest, ExposuresAreRoundedAndBounded) {
  SimulatedRig rig(path());
  EXPECT_EQ(rig.camera().SetExposureUs(1000.3), 1000.5);
  EXPECT_EQ(rig.camera().SetExposureUs(1000), 1000);
  EXPECT_THROW(rig.camera().SetExposureUs(0), Error);
  EXPECT_THROW(rig.camera().SetExposureUs(1e12), Error);
}

struct BadRig {
  const char* from;
  const char* to;
  const char* message;
};

TEST_F(SimulatedRigTest, BadFilesAreRefusedWithTheLine) {
  for (const BadRig& bad : {
           BadRig{"seed = 4", "sead = 4", "simulated.sead: unknown here"},
           BadRig{"\"phantom.toml\"", "\"nothing.toml\"", "nothing.toml"},
           BadRig{"field_mm = 36", "", "missing simulated.camera.field_mm"},
           BadRig{"width_px = 120",
                  "width_px = 3",
                  "simulated.camera.width_px: 3 is outside"},
           BadRig{"width_px = 120",
                  "width_px = 120\nshutter = 1",
                  "simulated.camera.shutter: unknown here"},
           BadRig{"[10, 8, 6]",
                  "[10, 8]",
                  "simulated.laser.power_mw: 2 values for 3 channels"},
           BadRig{"mm_per_rad = 400",
                  "mm_per_rad = 400\nchannels = [\"R\", \"G\"]",
                  "has other channels than this rig's scanner"},
       }) {
    Rewrite(bad.from, bad.to);
    EXPECT_THAT([&] { SimulatedRig{path()}; },
                ::testing::ThrowsMessage<Error>(HasSubstr(bad.message)));
  }
}

// The rigs that come with the software: boards in full view in every pose, windows of
// the outermost grid points too, and short exposures of the sample unsaturated.
TEST(ShippedRigs, SeeAllTheyMust) {
  for (const char* name : {"simulated-chessboard4x4.toml",
                           "simulated-chessboard4x4-quick.toml",
                           "simulated-stripes.toml"}) {
    SimulatedRig rig(std::string(NACRE_RIGS_FOLDER) + "/" + name);
    const acquire::RigDescription& description = rig.description();
    const acquire::CameraInfo info = rig.camera().Info();
    EXPECT_EQ(rig.phantom().slab.eta, description.sample.eta) << name;
    EXPECT_EQ(rig.phantom().grid.points_x, description.grid.points_x) << name;
    EXPECT_EQ(rig.phantom().grid.core, description.grid.core) << name;

    // An edge of the outermost window seen as a bright spot on the reference.
    const double rad = 1 / description.scanner.mm_per_rad;
    const double x = description.grid.HalfWidthMm() * rad;
    const double y = description.grid.HalfHeightMm() * rad;
    const std::array corners = {
        ScanAngle{x, y}, ScanAngle{-x, y}, ScanAngle{x, -y}, ScanAngle{-x, -y}};
    rig.stage().Place(Target::kReference, 0);
    for (const ScanAngle& corner : corners) {
      rig.illuminator().Light(std::array{corner}, 0);
      const auto picture = Picture(rig, 1, description.targets.reference_exposure_us);
      const auto brightest = std::max_element(picture.begin(), picture.end());
      EXPECT_GT(*brightest, 300) << name << ": a corner is out of view";
      EXPECT_LT(*brightest, 4095) << name << ": the reference saturates";
    }

    rig.stage().Place(Target::kSample, 0);
    const int spacing = description.schedule.spot_spacing_cells / 2 + 1;  // all media
    for (int channel = 0; channel < 3; ++channel) {
      std::vector<ScanAngle> spots;
      for (int j = spacing / 4; j < description.grid.points_y; j += spacing) {
        for (int i = spacing / 4; i < description.grid.points_x; i += spacing) {
          const PointMm p = description.grid.Point(i, j);
          spots.push_back({p.x * rad, p.y * rad});
        }
      }
      rig.illuminator().Light(spots, channel);
      const auto shortest = Picture(rig, 2, description.camera.exposures_us.back());
      const auto longest = Picture(rig, 3, description.camera.exposures_us.front());
      EXPECT_LT(*std::max_element(shortest.begin(), shortest.end()), 3900) << name;
      EXPECT_GT(*std::max_element(shortest.begin(), shortest.end()), 1000) << name;
      EXPECT_EQ(*std::max_element(longest.begin(), longest.end()), 4095) << name;
    }
    EXPECT_EQ(info.bit_depth, 12);
  }
}

}  // namespace
}  // namespace nacre::rigs

#include "rigs/laser_twin.h"

#include "core/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace nacre::rigs {
namespace {

using acquire::ScanAngle;
using ::testing::HasSubstr;

LaserModel TestModel() {
  LaserModel model;
  model.power_mw = {5, 6};
  model.channels = {"638nm", "520nm"};
  return model;
}

TEST(LaserTwin, SpotsComeFromTheMirrors) {
  LaserModel model = TestModel();
  const Spot axis = model.SpotAt({0, 0});
  EXPECT_EQ(axis.centre_mm, PointMm{});
  EXPECT_EQ(axis.cos_incidence, 1);
  // By hand: 6 tan 0.1 + 400 tan 0.1 / cos 0.15, 400 tan 0.15.
  const Spot spot = model.SpotAt({0.1, 0.15});
  EXPECT_NEAR(spot.centre_mm.x, 41.19165, 1e-5);
  EXPECT_NEAR(spot.centre_mm.y, 60.45409, 1e-5);
  EXPECT_NEAR(spot.cos_incidence, 0.995004 * 0.988771, 1e-6);
}

// The corner of a square of angles is farther out than its sides say: tenths of a
// millimetre over a 126 mm field.
TEST(LaserTwin, DrawsAPincushion) {
  const LaserModel model = TestModel();
  const double angle = std::atan(63.0 / 400);
  const double side = model.SpotAt({angle, 0}).centre_mm.x;
  const double corner = model.SpotAt({angle, angle}).centre_mm.x;
  EXPECT_GT(corner - side, 0.3);
  EXPECT_LT(corner - side, 1.5);
}

TEST(LaserTwin, IsTurnedAndShifted) {
  LaserModel model = TestModel();
  model.rotation_rad = 0.01;
  model.offset_mm = {1, -2};
  const double along = 406 * std::tan(0.1);
  const Spot spot = model.SpotAt({0.1, 0});
  EXPECT_NEAR(spot.centre_mm.x, 1 + along * std::cos(0.01), 1e-9);
  EXPECT_NEAR(spot.centre_mm.y, -2 + along * std::sin(0.01), 1e-9);
}

TEST(LaserTwin, LightsAndBlanks) {
  auto world = std::make_shared<World>();
  {
    LaserTwin laser(TestModel(), world);
    EXPECT_THAT(laser.Info().channels, ::testing::ElementsAre("638nm", "520nm"));
    const std::array spots = {ScanAngle{0.1, 0}, ScanAngle{-0.1, 0.2}};
    const std::uint64_t before = world->revision;
    laser.Light(spots, 1);
    EXPECT_EQ(world->spots.size(), 2u);
    EXPECT_EQ(world->channel, 1);
    EXPECT_GT(world->revision, before);
    laser.Blank();
    EXPECT_TRUE(world->spots.empty());
    laser.Light(spots, 0);
  }
  EXPECT_TRUE(world->spots.empty()) << "a destroyed laser must be dark";
}

TEST(LaserTwin, RefusesWhatItCannotReach) {
  auto world = std::make_shared<World>();
  LaserTwin laser(TestModel(), world);
  const std::array near = {ScanAngle{0.1, 0}};
  const std::array far = {ScanAngle{0.1, 0}, ScanAngle{0, -0.31}};
  const std::array nowhere = {ScanAngle{std::nan(""), 0}};
  laser.Light(near, 0);
  EXPECT_THAT([&] { laser.Light(far, 0); },
              ::testing::ThrowsMessage<Error>(HasSubstr("(0.0000, -0.3100) rad")));
  EXPECT_THROW(laser.Light(nowhere, 0), Error);
  EXPECT_THAT([&] { laser.Light(near, 2); },
              ::testing::ThrowsMessage<Error>(HasSubstr("channel 2; it has 2")));
}

}  // namespace
}  // namespace nacre::rigs

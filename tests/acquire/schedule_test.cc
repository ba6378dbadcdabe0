#include "acquire/schedule.h"

#include "tests/acquire/fake_rig.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>
#include <tuple>

namespace nacre::acquire {
namespace {

using testing::TestRig;

TEST(Schedule, CountsOfEveryTarget) {
  const Schedule schedule(TestRig());
  std::map<Target, int> counts;
  for (std::int64_t k = 0; k < schedule.size(); ++k) {
    ++counts[schedule[k].target];
    EXPECT_EQ(k >= schedule.grid_begin(), schedule[k].target == Target::kSample);
  }
  // Exposures 500, 1000, 1500, 2000, 4000, 8000, two dark frames each.
  EXPECT_EQ(schedule.exposures_us(),
            (std::vector<double>{500, 1000, 1500, 2000, 4000, 8000}));
  EXPECT_EQ(counts[Target::kNothing], 12);
  EXPECT_EQ(counts[Target::kCheckerboard], 3);
  EXPECT_EQ(counts[Target::kFlat], 4);
  EXPECT_EQ(counts[Target::kReference], 2);
  EXPECT_EQ(counts[Target::kSample], 16 * 2 * 2);
  EXPECT_EQ(schedule.group_count(), 16);
}

class SchedulesOfManyRigs : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SchedulesOfManyRigs, TakeEachPointChannelAndExposureOnce) {
  RandomStream random(GetParam(), 0);
  RigDescription rig = TestRig();
  rig.grid.points_x = 1 + static_cast<int>(random.Uniform() * 20);
  rig.grid.points_y = 1 + static_cast<int>(random.Uniform() * 20);
  rig.schedule.spot_spacing_cells = 3 + static_cast<int>(random.Uniform() * 8);
  rig.schedule.order_seed = GetParam() % 2 == 0 ? GetParam() : 0;
  const int spacing = rig.schedule.spot_spacing_cells;
  const Schedule schedule(rig);
  std::map<std::tuple<int, int, int, double>, int> taken;
  for (std::int64_t k = schedule.grid_begin(); k < schedule.size(); ++k) {
    const ScheduledPicture& picture = schedule[k];
    const auto group = schedule.Group(picture.group);
    for (const GridIndex& a : group) {
      ++taken[{a.i, a.j, picture.channel, picture.exposure_us}];
      for (const GridIndex& b : group) {
        EXPECT_TRUE(a == b || std::abs(a.i - b.i) >= spacing ||
                    std::abs(a.j - b.j) >= spacing);
      }
    }
  }
  EXPECT_EQ(static_cast<std::int64_t>(taken.size()), rig.grid.PointCount() * 2 * 2);
  for (const auto& [what, count] : taken) {
    EXPECT_EQ(count, 1);
    EXPECT_LT(std::get<0>(what), rig.grid.points_x);
    EXPECT_LT(std::get<1>(what), rig.grid.points_y);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds,
                         SchedulesOfManyRigs,
                         ::testing::Range<std::uint64_t>(1, 21));

TEST(Schedule, BracketsOfTheSameSpotsAreAdjacentLongestFirst) {
  const Schedule schedule(TestRig());
  for (std::int64_t k = schedule.grid_begin(); k < schedule.size(); k += 2) {
    EXPECT_EQ(schedule[k].group, schedule[k + 1].group);
    EXPECT_EQ(schedule[k].channel, schedule[k + 1].channel);
    EXPECT_EQ(schedule[k].exposure_us, 8000);
    EXPECT_EQ(schedule[k + 1].exposure_us, 1000);
  }
}

TEST(Schedule, OrderDependsOnTheSeedAlone) {
  const auto first_points = [](std::uint64_t seed) {
    RigDescription rig = TestRig();
    rig.schedule.order_seed = seed;
    const Schedule schedule(rig);
    std::vector<std::pair<int, int>> points;
    points.reserve(static_cast<std::size_t>(schedule.group_count()));
    for (int group = 0; group < schedule.group_count(); ++group) {
      points.emplace_back(schedule.Group(group)[0].i, schedule.Group(group)[0].j);
    }
    return points;
  };
  EXPECT_EQ(first_points(0)[1], (std::pair{1, 0}));
  EXPECT_EQ(first_points(5), first_points(5));
  EXPECT_NE(first_points(5), first_points(0));
  EXPECT_NE(first_points(5), first_points(6));
}

TEST(Schedule, LatticeRunsFromTheUpperLeftAndSurroundsTheGrid) {
  const RigDescription rig = TestRig();
  const Schedule schedule(rig);
  ASSERT_EQ(schedule.lattice().size(), 25U);
  const ScanAngle first = schedule.lattice().front();
  EXPECT_LT(first.x_rad * rig.scanner.mm_per_rad, rig.grid.Point(0, 0).x);
  EXPECT_GT(first.y_rad * rig.scanner.mm_per_rad, rig.grid.Point(0, 0).y);
  EXPECT_EQ(schedule.lattice()[1].y_rad, first.y_rad);
  EXPECT_GT(schedule.lattice()[1].x_rad, first.x_rad);
  EXPECT_NEAR(schedule.lattice()[12].x_rad, 0, 1e-15);
  EXPECT_NEAR(schedule.lattice()[12].y_rad, 0, 1e-15);
}

}  // namespace
}  // namespace nacre::acquire

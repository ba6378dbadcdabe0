#include "rigs/transport/monte_carlo/volume.h"

#include "core/error.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"
#include "tests/rigs/transport/monte_carlo/reference_totals.h"
#include "tests/rigs/transport/monte_carlo/support.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

namespace nacre::rigs::monte_carlo {
namespace {

using nacre::testing::ErrorMessage;

TEST(Volume, RefusesWhatMakesNoSense) {
  struct Bad {
    const char* expected;
    std::function<void(Volume&)> spoil;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Bad> cases{
      {"medium 0 has sigma_a -1", [](Volume& v) { v.media[0].sigma_a_per_mm = -1; }},
      {"g between -1 and 1", [](Volume& v) { v.media[0].g = 1; }},
      {"finite coefficients", [&](Volume& v) { v.media[0].sigma_s_per_mm = nan; }},
      {"no layers", [](Volume& v) { v.layers.clear(); }},
      {"layer 0 has thickness 0", [](Volume& v) { v.layers[0].thickness_mm = 0; }},
      {"an eta of at least 1", [](Volume& v) { v.layers[0].eta = 0.9; }},
      {"medium 7 of 2", [](Volume& v) { v.layers[0].medium = 7; }},
      {"infinite only at the bottom",
       [](Volume& v) {
         v.layers[0].thickness_mm = kInf;
         v.layers.push_back({1, 1, 0});
       }},
      {"pattern needs two media",
       [](Volume& v) {
         v.pattern = {PatternType::kChessboard, 0};
       }},
      {"not several of them",
       [](Volume& v) {
         v.pattern = {PatternType::kStripes, 1};
         v.layers.push_back({1, 1, 0});
       }},
      {"the numbers must be equal",
       [](Volume& v) {
         v.voxels = VoxelGrid{.count = {2, 1, 1},
                              .size_mm = {1, 1, 1},
                              .left_mm = 0,
                              .lower_mm = 0,
                              .medium = {0}};
       }},
      {"a voxel's medium",
       [](Volume& v) {
         v.voxels = VoxelGrid{.count = {1, 1, 1},
                              .size_mm = {1, 1, 1},
                              .left_mm = 0,
                              .lower_mm = 0,
                              .medium = {2}};
       }},
      {"half sides",
       [](Volume& v) {
         v.box = Box{0, 1};
       }},
      {"one refractive index",
       [](Volume& v) {
         v.box = Box{1, 1};
         v.layers.push_back({1, 1, 0});
       }},
      {"paths of infinite mean length",
       [](Volume& v) {
         v.media[0].sigma_a_per_mm = 0;
         v.layers[0].thickness_mm = kInf;
       }},
  };
  for (const Bad& bad : cases) {
    Volume volume = Slab({0.1, 1, 0}, 1, 1.3);
    volume.media.push_back({0.2, 1, 0});
    bad.spoil(volume);
    EXPECT_THAT(ErrorMessage([&] { Validate(volume); }),
                ::testing::HasSubstr(bad.expected));
  }
}

TEST(Volume, SimulateRefusesBadRequests) {
  const Volume volume = Slab({0.1, 1, 0}, 1, 1.3);
  const auto beam_refusal = [&](const Source& source) {
    return ErrorMessage([&] { Simulate(volume, source, {}, {}); });
  };
  EXPECT_THAT(beam_refusal({.width_mm = -1}),
              ::testing::HasSubstr("a beam of width -1"));
  EXPECT_THAT(beam_refusal({.angle_rad = 1.6}),
              ::testing::HasSubstr("below a right one"));
  const auto refusal = [&](const TallyRequest& request, const Options& options) {
    return ErrorMessage([&] { Simulate(volume, {}, request, options); },
                        ExitCode::kUsage);
  };
  EXPECT_THAT(refusal({.window_core = 3}, {}),
              ::testing::HasSubstr("needs a size greater than 0"));
  EXPECT_THAT(refusal({}, {.photon_count = 0}), ::testing::HasSubstr("photon_count"));
}

TEST(Volume, ComesFromAPhantom) {
  Phantom phantom;
  phantom.channels = {"R", "G"};
  phantom.slab = {.thickness_mm = 10, .eta = 1.5, .bottom = Bottom::kBlack};
  phantom.media = {{"A", {0.1, 0.2}, {1, 2}, {0, 0.5}},
                   {"B", {0.3, 0.4}, {3, 4}, {0, 0}}};
  phantom.pattern = {PatternType::kStripes, 1.5};
  const Volume volume = MakeVolume(phantom, 1);
  EXPECT_EQ(volume.media[0].sigma_a_per_mm, 0.2);
  EXPECT_EQ(volume.media[0].g, 0.5);
  EXPECT_EQ(volume.media[1].sigma_s_per_mm, 4);
  EXPECT_EQ(volume.layers[0].eta, 1.5);
  EXPECT_EQ(volume.bottom, Bottom::kBlack);
  EXPECT_EQ(volume.MediumAt(2, 0, 1), 1U);
}

TEST(Volume, PointsOutsideAVoxelGridBelongToTheNearestVoxel) {
  const VoxelGrid grid{.count = {2, 2, 1},
                       .size_mm = {1, 1, 1},
                       .left_mm = -1,
                       .lower_mm = -1,
                       .medium = {0, 1, 2, 3}};
  EXPECT_EQ(grid.MediumAt(-0.5, -0.5, 0.5), 0U);
  EXPECT_EQ(grid.MediumAt(0.5, -0.5, 0.5), 1U);
  EXPECT_EQ(grid.MediumAt(-9, 9, 9), 2U);
  EXPECT_EQ(grid.MediumAt(9, 9, -9), 3U);
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

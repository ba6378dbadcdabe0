#include "rigs/transport/monte_carlo/symmetry.h"

#include "tests/rigs/transport/monte_carlo/reference_totals.h"
#include "tests/rigs/transport/monte_carlo/support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>

namespace nacre::rigs::monte_carlo {
namespace {

std::size_t Count(const Volume& volume, const Source& source) {
  return Symmetries(volume, source).size();
}

TEST(Symmetry, OfAPlainSlabIsComplete) {
  const Volume slab = Slab({0.1, 1, 0}, 1, 1.3);
  EXPECT_EQ(Count(slab, {.centre = {0.3, 0.1}}), 8U);
  EXPECT_EQ(Count(slab, {.shape = BeamShape::kSquare, .width_mm = 1}), 8U);
  EXPECT_EQ(Count(slab, {.angle_rad = 0.1}), 2U);  // the plane of incidence
  EXPECT_EQ(Count(slab, {.angle_rad = 0.1, .diffuse = true}), 8U);
}

TEST(Symmetry, OfPatternsDependsOnThePlace) {
  Volume volume = Chessboard();
  EXPECT_EQ(Count(volume, {.centre = {0.75, 0.75}}), 8U);
  EXPECT_EQ(Count(volume, {.centre = {2.25, -3.75}}), 8U);
  EXPECT_EQ(Count(volume, {.centre = {0.75, 0.4}}), 2U);
  EXPECT_EQ(Count(volume, {.centre = {0.4, 0.4}}), 2U);
  EXPECT_EQ(Count(volume, {.centre = {0.4, 0.9}}), 1U);
  EXPECT_EQ(Count(volume, {.centre = {0, 0}}), 4U);
  volume.pattern.type = PatternType::kStripes;
  EXPECT_EQ(Count(volume, {.centre = {0.75, 0.4}}), 4U);
  EXPECT_EQ(Count(volume, {.centre = {0, 0.4}}), 2U);
}

TEST(Symmetry, OfBoxesAndVoxels) {
  Volume volume = Slab({0.1, 1, 0}, 1, 1.3);
  volume.box = Box{1, 1};
  EXPECT_EQ(Count(volume, {}), 8U);
  EXPECT_EQ(Count(volume, {.centre = {0.2, 0}}), 2U);
  EXPECT_EQ(Count(volume, {.centre = {0.2, 0.2}}), 2U);
  volume.box = Box{1, 2};
  EXPECT_EQ(Count(volume, {}), 4U);
  volume.box.reset();
  volume.voxels = VoxelGrid{.count = {1, 1, 1},
                            .size_mm = {1, 1, 1},
                            .left_mm = 0,
                            .lower_mm = 0,
                            .medium = {0}};
  EXPECT_EQ(Count(volume, {}), 1U);
}

// Every motion that Symmetries names leaves the window what it is, within noise; where
// it names too many, this fails.
TEST(Symmetry, AveragesAreUnbiasedAndLessNoisy) {
  Volume volume = Chessboard();
  for (const PointMm x_i :
       {PointMm{0.75, 0.75}, PointMm{0, 0}, PointMm{0.4, 0.4}, PointMm{0.75, 0.4}}) {
    TallyRequest request{
        .window_centre = x_i, .window_core = 21, .window_pitch_mm = 0.25};
    const Source source{.centre = x_i};
    const Result plain = Simulate(volume, source, request, Photons(120'000, 1));
    request.use_symmetry = true;
    const Result same = Simulate(volume, source, request, Photons(120'000, 1));
    const Result other = Simulate(volume, source, request, Photons(120'000, 2));
    double sum_plain = 0;
    double sum_same = 0;
    double chi2 = 0;
    for (std::size_t k = 0; k < plain.window_per_mm2.size(); ++k) {
      sum_plain += plain.window_per_mm2[k].mean;
      sum_same += same.window_per_mm2[k].mean;
      const double z = Deviation(plain.window_per_mm2[k], other.window_per_mm2[k]);
      chi2 += z * z;
    }
    EXPECT_NEAR(sum_plain, sum_same, 1e-9 * sum_plain);
    EXPECT_NEAR(chi2 / static_cast<double>(plain.window_per_mm2.size()), 1, 0.25);
  }
}

TEST(Symmetry, ErrorsFallByTheRootOfTheImages) {
  TallyRequest request{.window_core = 9, .window_pitch_mm = 0.25};
  const Volume slab = Slab({0.05, 1, 0}, kInf, 1.5);
  const Result plain = Simulate(slab, {}, request, Photons(200'000));
  request.use_symmetry = true;
  const Result shared = Simulate(slab, {}, request, Photons(200'000));
  const std::size_t general = 3 * 9 + 6;  // d = (2, 1) cells: eight images
  EXPECT_NEAR(plain.window_per_mm2[general].se / shared.window_per_mm2[general].se,
              std::sqrt(8),
              0.15);
  const std::size_t centre = 4 * 9 + 4;  // its own image
  EXPECT_EQ(plain.window_per_mm2[centre].mean, shared.window_per_mm2[centre].mean);
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

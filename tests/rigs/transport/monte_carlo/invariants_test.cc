#include "core/error.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"
#include "tests/rigs/transport/monte_carlo/reference_totals.h"
#include "tests/rigs/transport/monte_carlo/support.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

const TallyRequest kWindow{.window_core = 15, .window_pitch_mm = 0.25};

std::vector<double> Means(const Result& r) {
  std::vector<double> values{r.reflected.mean,
                             r.transmitted.mean,
                             r.absorbed.mean,
                             r.sides.mean,
                             static_cast<double>(r.step_count)};
  for (const Estimate& cell : r.window_per_mm2) {
    values.push_back(cell.mean);
  }
  return values;
}

std::vector<Volume> OneOfEachKind() {
  std::vector<Volume> volumes{Slab({0.01, 5, 0.8}, kInf, 1.37), Chessboard()};
  volumes.push_back(Slab({0.005, 1, 0.01}, 60, 1.37));
  volumes.back().box = Box{30, 30};
  Volume layers;
  layers.media = {{0.1, 10, 0.9}, {0.1, 1, 0}};
  layers.layers = {{0.2, 1.37, 0}, {0.4, 1.5, 1}, {2, 1.37, 0}};
  layers.bottom = Bottom::kWhite;
  volumes.push_back(layers);
  Volume voxels = Slab({0.01, 5, 0.8}, 1, 1.3);
  voxels.media.push_back({0.5, 1, -0.3});
  voxels.voxels = VoxelGrid{.count = {2, 1, 3},
                            .size_mm = {0.7, 1, 0.33},
                            .left_mm = -0.7,
                            .lower_mm = 0,
                            .medium = {0, 1, 1, 1, 1, 0}};
  volumes.push_back(voxels);
  return volumes;
}

TEST(Invariants, AnyNumberOfThreadsGivesTheSameResult) {
  for (const Volume& volume : OneOfEachKind()) {
    Options options = Photons(20'001);
    options.thread_count = 1;
    const auto one = Means(Simulate(volume, {}, kWindow, options));
    for (const int count : {2, 3}) {
      options.thread_count = count;
      EXPECT_EQ(Means(Simulate(volume, {}, kWindow, options)), one);
    }
  }
}

TEST(Invariants, AnyInstructionSetGivesTheSameResult) {
  ASSERT_GE(InstructionSets().size(), 1U);
  const Source source{.shape = BeamShape::kGaussian, .width_mm = 1, .angle_rad = 0.3};
  for (const Volume& volume : OneOfEachKind()) {
    UseInstructionSet("");
    const auto best = Means(Simulate(volume, source, kWindow, Photons(20'000)));
    for (const std::string& name : InstructionSets()) {
      UseInstructionSet(name);
      EXPECT_EQ(Means(Simulate(volume, source, kWindow, Photons(20'000))), best)
          << name;
    }
  }
  UseInstructionSet("");
  EXPECT_THROW(UseInstructionSet("MMX"), Error);
}

TEST(Invariants, AnotherSeedGivesAnotherResult) {
  const Volume volume = Chessboard();
  EXPECT_NE(Means(Simulate(volume, {}, kWindow, Photons(20'000, 1))),
            Means(Simulate(volume, {}, kWindow, Photons(20'000, 2))));
}

// The first photons of a longer run are the photons of a shorter one.
TEST(Invariants, PhotonsAreTheirOwn) {
  const Volume volume = Chessboard();
  const Result some = Simulate(volume, {}, {}, Photons(5'000));
  const Result more = Simulate(volume, {}, {}, Photons(5'001));
  const double difference = 5'001 * more.reflected.mean - 5'000 * some.reflected.mean;
  EXPECT_TRUE(std::abs(difference) < 1e-6 || std::abs(difference - 1) < 1e-6);
}

TEST(Invariants, LengthsScale) {
  const Result a =
      Simulate(Slab({0.05, 1, 0.5}, 4, 1.4), {}, kWindow, Photons(400'000, 1));
  const TallyRequest twice{.window_core = 15, .window_pitch_mm = 0.5};
  const Result b =
      Simulate(Slab({0.025, 0.5, 0.5}, 8, 1.4), {}, twice, Photons(400'000, 2));
  EXPECT_LT(std::abs(Deviation(a.reflected, b.reflected)), 3.5);
  for (std::size_t k = 0; k < a.window_per_mm2.size(); ++k) {
    const Estimate scaled{4 * b.window_per_mm2[k].mean, 4 * b.window_per_mm2[k].se};
    EXPECT_LT(std::abs(Deviation(a.window_per_mm2[k], scaled)), 4.5);
  }
}

// Moved by a cell along both axes, or by two along one, a chessboard is itself.
TEST(Invariants, AChessboardRepeats) {
  const Volume volume = Chessboard();
  const auto around = [&](PointMm x_i, std::int64_t seed) {
    TallyRequest request = kWindow;
    request.window_centre = x_i;
    return Simulate(volume, {.centre = x_i}, request, Photons(400'000, seed));
  };
  const Result here = around({0.4, 0.9}, 1);
  double chi2 = 0;
  const std::vector<PointMm> places{{1.9, 2.4}, {3.4, 0.9}, {0.4, -2.1}};
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Result there = around(places[k], 2 + static_cast<std::int64_t>(k));
    EXPECT_LT(std::abs(Deviation(here.reflected, there.reflected)), 3.5);
    for (std::size_t c = 0; c < here.window_per_mm2.size(); ++c) {
      const double z = Deviation(here.window_per_mm2[c], there.window_per_mm2[c]);
      chi2 += z * z;
    }
  }
  EXPECT_LT(chi2 / 675, 1.25);
  EXPECT_LT(Deviation(around({1.9, 0.9}, 9).reflected, here.reflected), -10)
      << "one cell along one axis is the other medium";
}

// Lambertian light in, all light out: what goes from one square to another goes back.
TEST(Invariants, DiffuseLightIsReciprocal) {
  const Volume volume = Chessboard();
  const auto between = [&](PointMm from, PointMm to, bool diffuse, std::int64_t seed) {
    const Source source{.centre = from,
                        .shape = BeamShape::kSquare,
                        .width_mm = 0.5,
                        .diffuse = diffuse};
    const TallyRequest request{
        .window_centre = to, .window_core = 1, .window_pitch_mm = 0.5};
    return Simulate(
               volume, source, request, Photons(diffuse ? 700'000 : 4'000'000, seed))
        .window_per_mm2[0];
  };
  const PointMm marble{0.75, 0.75};
  const PointMm dark{2.25, 0.75};
  EXPECT_LT(std::abs(Deviation(between(marble, dark, true, 1),
                               between(dark, marble, true, 2))),
            3);
  // Normal incidence is not the reverse of leaving in all directions.
  const Estimate there = between(marble, dark, false, 3);
  const Estimate back = between(dark, marble, false, 4);
  EXPECT_GT(std::abs(Deviation(there, back)), 4);
}

// bench/rigs/monte_carlo_convergence: four decades, more replicas.
TEST(Invariants, ErrorsFallAsTheRootOfThePhotons) {
  const Volume volume = Slab({0.4, 0.1, 0.5}, 1, 1.33);
  constexpr double kEntered = 1 - 0.020059;
  constexpr double kTruth = 0.612666 / kEntered;  // adding-doubling, row M20
  constexpr int kReplicas = 500;
  double slope_numerator = 0;
  std::array<double, 4> scaled{};
  for (std::size_t decade = 0; decade < 4; ++decade) {
    const auto photons =
        static_cast<std::int64_t>(std::pow(10.0, 2.0 + static_cast<double>(decade)));
    double sum = 0;
    for (int k = 0; k < kReplicas; ++k) {
      const double error =
          Simulate(volume, {}, {}, Photons(photons, 1000 + k)).transmitted.mean -
          kTruth;
      sum += error * error;
    }
    scaled[decade] = std::sqrt(sum / kReplicas * static_cast<double>(photons));
    // The binomial law, to the noise of 500 replicas, 3 %.
    EXPECT_NEAR(scaled[decade], std::sqrt(kTruth * (1 - kTruth)), 0.055);
    slope_numerator += (static_cast<double>(decade) - 1.5) * std::log10(scaled[decade]);
  }
  EXPECT_NEAR(slope_numerator / 5, 0, 0.02);  // the exponent is −1/2 ± 0.02
}

TEST(Invariants, CanBeStopped) {
  EXPECT_THROW(Simulate(Chessboard(),
                        {},
                        {},
                        Photons(1'000'000),
                        [](const Progress&) { return false; }),
               Error);
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

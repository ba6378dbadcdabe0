// Samples that are kept, added to and counted.

#include "core/atomic_file.h"
#include "core/error.h"
#include "render/sample_plan.h"
#include "tests/render/scene_text.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;

// A small bright light far away makes noise on one side; the other is even.
Scene HalfNoisy() {
  return Parse(SceneText(R"(
    <shape type="rectangle"><transform name="toWorld"><scale value="3"/></transform>
      <bsdf type="diffuse"/></shape>
    <shape type="rectangle"><transform name="toWorld"><scale value="0.3"/>
      <rotate y="1" angle="180"/><translate x="0.6" z="0.3"/></transform>
      <emitter type="area"><rgb name="radiance" value="30"/></emitter></shape>
    <emitter type="directional"><vector name="direction" x="0" y="0" z="-1"/>
      <rgb name="irradiance" value="1"/></emitter>)",
                         "0, 0, 6",
                         "0, 0, 0",
                         32));
}

RenderOptions Spp(int spp) {
  RenderOptions options;
  options.spp = spp;
  options.thread_count = 1;
  options.sampling = "even";
  return options;
}

TEST(SamplePlanTest, PassesAreEvenUnlessAdaptive) {
  const Film film{.width = 20, .height = 9, .crop_width = 20, .crop_height = 9};
  const SamplePlan plan(film, {.spp = 5});
  EXPECT_EQ(plan.TileCount(), 3 * 2);
  EXPECT_EQ(plan.PixelsOf(0), 64);
  EXPECT_EQ(plan.PixelsOf(5), 4);
  Accumulator sums(film);
  std::vector<int> ends;
  for (auto next = plan.Next(sums); !next.empty(); next = plan.Next(sums)) {
    for (std::size_t pixel = 0; pixel < sums.PixelCount(); ++pixel) {
      for (auto n = sums.SamplesMade(pixel); n < next[0]; ++n) {
        sums.Add(pixel, {1, 1, 1}, 1, 1);
      }
    }
    ends.push_back(next[0]);
  }
  EXPECT_EQ(ends, (std::vector<int>{1, 2, 4, 5}));
}

// Two tiles, one of them with nine times the variance: three times the samples.
TEST(SamplePlanTest, SamplesGoWithTheSpread) {
  const Film film{.width = 64, .height = 8, .crop_width = 64, .crop_height = 8};
  const SamplePlan plan(film, {.spp = 64, .sampling = Sampling::kAdaptive});
  Accumulator sums(film);
  for (auto next = plan.Next(sums); !next.empty(); next = plan.Next(sums)) {
    for (std::size_t pixel = 0; pixel < sums.PixelCount(); ++pixel) {
      const std::size_t tile = pixel % 64 / 8;
      const float spread = tile < 4 ? 1.0F : 3.0F;
      for (auto n = sums.SamplesMade(pixel); n < next[tile]; ++n) {
        const float value = 5 + (n % 2 == 0 ? spread : -spread);
        sums.Add(pixel, {value, value, value}, 1, 1);
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(sums.SamplesMade(0)), 32, 4);
  EXPECT_NEAR(static_cast<double>(sums.SamplesMade(63)), 96, 4);
}

TEST(SamplingTest, AdaptiveSamplesLowerTheErrorForTheSameNumber) {
  const Scene scene = HalfNoisy();
  const Rendering even = Render(scene, Spp(64));
  RenderOptions options = Spp(64);
  options.sampling = "adaptive";
  options.aovs = true;
  const Rendering adaptive = Render(scene, options);
  EXPECT_EQ(even.summary.samples_least, 64);
  EXPECT_EQ(even.summary.samples_most, 64);
  EXPECT_NEAR(adaptive.summary.samples_per_pixel, 64, 4);
  EXPECT_LT(adaptive.summary.samples_least, 32);
  EXPECT_GT(adaptive.summary.samples_most, 80);
  EXPECT_LT(adaptive.summary.relative_error, 0.9 * even.summary.relative_error);
  double difference = 0;
  double sum = 0;
  for (std::size_t i = 0; i < even.image.values.size(); ++i) {
    difference += static_cast<double>(adaptive.image.values[i] - even.image.values[i]);
    sum += static_cast<double>(even.image.values[i]);
  }
  EXPECT_LT(std::abs(difference) / sum, 0.005);  // no bias that would show
}

TEST(SamplingTest, ByDefaultSamplesEndWhenTheErrorIsThatOfEvenOnes) {
  const Scene scene = HalfNoisy();
  const Rendering even = Render(scene, Spp(64));
  RenderOptions options = Spp(64);
  options.sampling = RenderOptions().sampling;
  const Rendering by_default = Render(scene, options);
  EXPECT_LT(by_default.summary.samples_per_pixel, 0.75 * 64);
  EXPECT_LT(by_default.summary.relative_error, 1.02 * even.summary.relative_error);
  EXPECT_GT(by_default.summary.relative_error, 0.85 * even.summary.relative_error);
  // Where there is too little to plan with, and where there must be no bias.
  options.spp = 8;
  EXPECT_EQ(Render(scene, options).image.values, Render(scene, Spp(8)).image.values);
  options.spp = 20;
  options.integrator = "reference";
  EXPECT_EQ(Render(scene, options).summary.samples_least, 20);
  options.sampling = "odd";
  EXPECT_THROW(Render(scene, options), Error);
}

TEST(SamplingTest, AnErrorTargetIsReachedWithFewerSamples) {
  const Scene scene = HalfNoisy();
  RenderOptions options = Spp(0);
  options.error_target = 0.03;
  const Rendering even = Render(scene, options);
  options.sampling = "adaptive";
  const Rendering adaptive = Render(scene, options);
  EXPECT_LE(adaptive.summary.relative_error, 0.03);
  EXPECT_GT(adaptive.summary.relative_error, 0.024);
  EXPECT_LT(adaptive.summary.samples_per_pixel, 0.9 * even.summary.samples_per_pixel);
}

TEST(SamplingTest, AovsAreVarianceAndNumber) {
  const Scene scene = HalfNoisy();
  RenderOptions options = Spp(16);
  options.aovs = true;
  const Rendering r = Render(scene, options);
  ASSERT_EQ(r.aovs.size(), 2u);
  EXPECT_EQ(r.aovs[0].name, "variance");
  EXPECT_EQ(r.aovs[1].name, "samples");
  double variance = 0;
  double squares = 0;
  for (std::size_t i = 0; i < r.image.PixelCount(); ++i) {
    variance += static_cast<double>(r.aovs[0].values[i]);
    EXPECT_EQ(r.aovs[1].values[i], 16);
    const double y = 0.2126 * static_cast<double>(r.image.Channel(0)[i]) +
                     0.7152 * static_cast<double>(r.image.Channel(1)[i]) +
                     0.0722 * static_cast<double>(r.image.Channel(2)[i]);
    squares += y * y;
  }
  EXPECT_NEAR(std::sqrt(variance / squares), r.summary.relative_error, 1e-6);
  EXPECT_TRUE(Render(scene, Spp(1)).aovs.empty());
}

TEST(CheckpointTest, WorkInTwoPartsGivesTheSameBits) {
  const nacre::testing::TempFolder folder;
  const Checkpoint checkpoint{folder.path() / "half", "scene a"};
  const Scene scene = HalfNoisy();
  for (const char* sampling : {"even", "adaptive", "auto"}) {
    RenderOptions whole = Spp(40);
    whole.sampling = sampling;
    const Rendering once = Render(scene, whole);
    std::filesystem::remove(checkpoint.path);
    Render(scene, Spp(16), {}, {}, checkpoint);
    const Rendering resumed = Render(scene, whole, {}, {}, checkpoint);
    EXPECT_EQ(resumed.summary.samples_resumed, 16);
    EXPECT_EQ(resumed.image.values, once.image.values);
    EXPECT_LT(resumed.summary.rays, once.summary.rays);
  }
}

// A pass that was stopped anywhere in it is ended as it was planned.
TEST(CheckpointTest, WorkThatIsStoppedGoesOnToTheSameBits) {
  const nacre::testing::TempFolder folder;
  const Checkpoint checkpoint{folder.path() / "half", "scene a"};
  const Scene scene = HalfNoisy();
  for (const char* sampling : {"even", "adaptive"}) {
    RenderOptions options = Spp(24);
    options.sampling = sampling;
    const Rendering once = Render(scene, options);
    std::filesystem::remove(checkpoint.path);
    int stops = 0;
    for (bool is_done = false; !is_done;) {
      int tiles = 0;
      try {
        const Rendering resumed = Render(
            scene,
            options,
            [&](const Progress& p) { return p.stage != "render" || ++tiles < 21; },
            {},
            checkpoint);
        EXPECT_EQ(resumed.image.values, once.image.values) << sampling;
        is_done = true;
      } catch (const Error& e) {
        ASSERT_EQ(e.code(), ExitCode::kInterrupted);
        EXPECT_THAT(e.what(), HasSubstr("the same command goes on"));
        ++stops;
      }
    }
    EXPECT_GT(stops, 3);
  }
}

TEST(CheckpointTest, WhatDoesNotFitIsRefused) {
  const nacre::testing::TempFolder folder;
  const Checkpoint checkpoint{folder.path() / "half", "scene a"};
  const Film film{.width = 4, .height = 4, .crop_width = 4, .crop_height = 4};
  Accumulator sums(film);
  std::vector<int> pass;
  EXPECT_FALSE(ReadCheckpoint(checkpoint, sums, pass));
  sums.Add(3, {1, 2, 3}, 1, 1);
  WriteCheckpoint(checkpoint, sums, {7});
  Accumulator same(film);
  EXPECT_TRUE(ReadCheckpoint(checkpoint, same, pass));
  EXPECT_EQ(same.Bytes(), sums.Bytes());
  EXPECT_EQ(pass, std::vector<int>{7});
  const auto message = [&](const Checkpoint& of, Accumulator into) {
    try {
      ReadCheckpoint(of, into, pass);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message({checkpoint.path, "scene b"}, same), HasSubstr("another scene"));
  const Film larger{.width = 5, .height = 4, .crop_width = 5, .crop_height = 4};
  EXPECT_THAT(message(checkpoint, Accumulator(larger)), HasSubstr("another size"));
  const std::string whole = ReadFile(checkpoint.path);
  for (const std::size_t length :
       {std::size_t{0}, whole.size() / 2, whole.size() - 1}) {
    WriteFile(checkpoint.path, whole.substr(0, length));
    EXPECT_NE(message(checkpoint, same), "no error") << length;
  }
  std::string damaged = whole;
  damaged[whole.size() / 2] ^= 1;
  WriteFile(checkpoint.path, damaged);
  EXPECT_THAT(message(checkpoint, same), HasSubstr("damaged"));
}

}  // namespace
}  // namespace nacre::render::testing

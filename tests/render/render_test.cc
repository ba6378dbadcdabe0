#include "render/render.h"

#include "render/tone.h"
#include "tests/render/scene_text.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <fstream>
#include <numbers>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;

RenderOptions With(int spp, int threads = 1) {
  RenderOptions options;
  options.spp = spp;
  options.thread_count = threads;
  options.sampling = "even";
  return options;
}

const char* const kFurnace =
    R"(<emitter type="constant"><rgb name="radiance" value="1"/></emitter>)";

// Everything white in a white world is invisible: light sampling, BSDF sampling, their
// combination, roulette and geometry together lose and gain nothing.
TEST(RenderTest, WhiteFurnaceForEveryBsdfOnASphereAndOnAMesh) {
  for (
      const char* bsdf :
      {R"(<bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf>)",
       R"(<bsdf type="plastic"><rgb name="diffuseReflectance" value="1"/></bsdf>)",
       R"(<bsdf type="roughplastic"><rgb name="diffuseReflectance" value="1"/>
           <float name="alpha" value="0.3"/></bsdf>)",
       R"(<bsdf type="roughplastic"><rgb name="diffuseReflectance" value="1"/>
           <string name="distribution" value="ggx"/><float name="alpha" value="0.1"/>
           <boolean name="nonlinear" value="true"/></bsdf>)",
       R"(<bsdf type="roughconductor"><string name="material" value="none"/>
           <string name="distribution" value="ggx"/><float name="alpha" value="0.5"/></bsdf>)",
       R"(<bsdf type="conductor"><string name="material" value="none"/></bsdf>)",
       R"(<bsdf type="dielectric"/>)",
       R"(<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="1"/>
           </bsdf></bsdf>)"}) {
    for (const char* shape : {"sphere", "cube"}) {
      const std::string text = SceneText(
          std::string("<shape type=\"") + shape + "\">" + bsdf + "</shape>" + kFurnace,
          "3, 4, 5");
      const Rendering r = Render(Parse(text), With(256));
      const Statistics s = ChannelStatistics(r.image, 1);
      // Four standard errors and 1e-3 for the tables of rough interfaces.
      EXPECT_NEAR(s.mean, 1, 4 * s.standard_error + 1e-3) << bsdf << shape;
      EXPECT_EQ(r.summary.bad_samples, 0);
    }
  }
}

// A grey cavity: radiance Σ ρ^k of all bounces.
TEST(RenderTest, AClosedCavityGivesTheGeometricSeries) {
  const std::string walls = R"(<shape type="sphere">
    <boolean name="flipNormals" value="true"/><float name="radius" value="10"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>)";
  const Statistics all =
      ChannelStatistics(Render(Parse(SceneText(walls)), With(512)).image, 0);
  EXPECT_NEAR(all.mean, 1 / (1 - 0.6), 5 * all.standard_error + 2e-3);
  const auto bounces = [&](const std::string& integrator) {
    return ChannelStatistics(
               Render(Parse(SceneText(integrator + walls)), With(256)).image, 0)
        .mean;
  };
  EXPECT_NEAR(bounces(R"(<integrator type="direct"/>)"), 1.6, 0.01);
  EXPECT_NEAR(
      bounces(
          R"(<integrator type="path"><integer name="maxDepth" value="1"/></integrator>)"),
      1,
      1e-5);
  EXPECT_NEAR(
      bounces(
          R"(<integrator type="path"><integer name="maxDepth" value="3"/></integrator>)"),
      1 + 0.6 + 0.36,
      0.01);
}

const char* const kMixed = R"(
  <emitter type="spot"><transform name="toWorld"><lookat origin="3,4,5" target="0,0,0"/>
    </transform><rgb name="intensity" value="100"/></emitter>
  <emitter type="constant"><rgb name="radiance" value="0.1, 0.2, 0.3"/></emitter>
  <shape type="rectangle"><transform name="toWorld"><scale value="5"/>
    <translate z="-1"/></transform><bsdf type="roughplastic">
    <texture name="diffuseReflectance" type="checkerboard"/></bsdf></shape>
  <shape type="sphere"><float name="radius" value="0.5"/><bsdf type="dielectric"/></shape>
  <shape type="cube"><transform name="toWorld"><scale value="0.3"/>
    <translate x="0.4" z="-0.6"/></transform>
    <subsurface type="dipole"><string name="material" value="skin1"/>
    <float name="scale" value="5"/><integer name="irrSamples" value="4"/></subsurface>
    </shape>)";

TEST(RenderTest, TheSameBitsForAnyNumberOfThreads) {
  const Scene scene = Parse(SceneText(kMixed, "0, 2, 5", "0, 0, 0", 40));
  const Rendering one = Render(scene, With(8, 1));
  for (const int threads : {2, 3}) {
    EXPECT_EQ(Render(scene, With(8, threads)).image.values, one.image.values);
  }
  RenderOptions other = With(8, 2);
  other.seed = 2;
  EXPECT_NE(Render(scene, other).image.values, one.image.values);
  EXPECT_EQ(one.summary.bad_samples, 0);
  EXPECT_GT(one.summary.lit_points, 100);
}

TEST(RenderTest, ACropShowsTheSamePixels) {
  const std::string text = SceneText(kMixed, "0, 2, 5", "0, 0, 0", 24);
  std::string cropped = text;
  cropped.replace(cropped.find("<rfilter"),
                  0,
                  R"(<integer name="cropOffsetX" value="5"/>
                     <integer name="cropOffsetY" value="7"/>
                     <integer name="cropWidth" value="3"/>
                     <integer name="cropHeight" value="2"/>)");
  const ExrPart whole = Render(Parse(text), With(2)).image;
  const ExrPart part = Render(Parse(cropped), With(2)).image;
  ASSERT_EQ(part.width, 3);
  ASSERT_EQ(part.height, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      EXPECT_EQ(part.Channel(1)[y * 3 + x], whole.Channel(1)[(y + 7) * 24 + x + 5]);
    }
  }
}

TEST(RenderTest, LinearInTheLight) {
  const auto mean = [](const std::string& intensity) {
    return ChannelStatistics(Render(Parse(SceneText(
                                        R"(<shape type="sphere"/><emitter type="point">
                             <point name="position" x="3" y="3" z="3"/>
                             <rgb name="intensity" value=")" +
                                        intensity + R"("/></emitter>)")),
                                    With(16))
                                 .image,
                             0)
        .mean;
  };
  EXPECT_NEAR(mean("8"), 8 * mean("1"), 1e-6);
}

TEST(RenderTest, AlphaIsCoverage) {
  // Half a unit: well inside the film, whose corners are 1.25 units out.
  std::string text =
      SceneText(R"(<shape type="sphere"><float name="radius" value="0.5"/>
    </shape>)");
  text.replace(
      text.find("<rfilter"), 0, R"(<string name="pixelFormat" value="rgba"/>)");
  const ExrPart image = Render(Parse(text), With(4)).image;
  ASSERT_EQ(image.channels.back(), "A");
  EXPECT_EQ(image.Channel(3)[0], 0);
  EXPECT_EQ(image.Channel(3)[8 * 4 + 4], 1);
}

TEST(RenderTest, ClampingCountsAndBounds) {
  const std::string text = SceneText(
      R"(<shape type="sphere"><emitter type="area"><rgb name="radiance" value="9, 3, 0"/>
         </emitter></shape>)");
  RenderOptions options = With(2);
  options.clamp = 3;
  const Rendering r = Render(Parse(text), options);
  EXPECT_GT(r.summary.clamped_samples, 0);
  EXPECT_NEAR(r.image.Channel(0)[8 * 4 + 4], 3, 1e-6);
  EXPECT_NEAR(r.image.Channel(1)[8 * 4 + 4], 1, 1e-6);
}

TEST(RenderTest, ATimeLimitStopsEarlyAndSaysSo) {
  const Scene scene = Parse(SceneText(kMixed, "0, 2, 5", "0, 0, 0", 16));
  RenderOptions options = With(1 << 20);
  options.time_limit_s = 0.2;
  const Rendering r = Render(scene, options);
  EXPECT_TRUE(r.summary.time_ran_out);
  EXPECT_GE(r.summary.samples_per_pixel, 1);
  EXPECT_LT(r.summary.samples_per_pixel, 1 << 20);
  EXPECT_THAT(r.summary.Brief(), HasSubstr("time limit"));
}

TEST(RenderTest, AnErrorTargetStopsWhenItIsReached) {
  const Scene scene = Parse(SceneText(kMixed, "0, 2, 5", "0, 0, 0", 16));
  RenderOptions options = With(0);
  options.error_target = 0.05;
  const Rendering rough = Render(scene, options);
  EXPECT_LE(rough.summary.relative_error, 0.05);
  options.error_target = 0.02;
  const Rendering fine = Render(scene, options);
  EXPECT_LE(fine.summary.relative_error, 0.02);
  EXPECT_GT(fine.summary.samples_per_pixel, 2 * rough.summary.samples_per_pixel);
}

TEST(RenderTest, SnapshotsComeBetweenPassesAndProgressCanStop) {
  const Scene scene = Parse(SceneText(kMixed, "0, 2, 5", "0, 0, 0", 16));
  RenderOptions options = With(32);
  options.snapshot_s = 1e-9;
  int snapshots = 0;
  Render(scene, options, {}, [&](const ExrPart& image) {
    ++snapshots;
    EXPECT_EQ(image.values.size(), 3u * 16 * 16);
  });
  EXPECT_GE(snapshots, 3);
  try {
    Render(scene, With(4), [](const Progress& p) { return p.stage != "render"; });
    ADD_FAILURE() << "went on";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kInterrupted);
  }
}

TEST(RenderTest, UnknownIntegratorsAreUsageErrors) {
  RenderOptions options = With(1);
  options.integrator = "refrence";
  try {
    Render(Parse(SceneText("")), options);
    ADD_FAILURE() << "accepted";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(),
                HasSubstr("there are scene, path, direct, fast, sppm and reference"));
  }
}

TEST(RenderTest, AnEmptySceneIsBlack) {
  const ExrPart image = Render(Parse(SceneText("")), With(1)).image;
  EXPECT_EQ(*std::max_element(image.values.begin(), image.values.end()), 0);
}

// A ball of few corners with smooth normals: at its silhouette these turn away from the
// viewer, who would see black there.
std::string CoarseBall(const std::filesystem::path& folder) {
  constexpr int kAround = 10;
  constexpr int kRings = 6;
  std::ofstream obj(folder / "ball.obj");
  for (int j = 0; j <= kRings; ++j) {
    const double polar = std::numbers::pi * j / kRings;
    for (int i = 0; i < kAround; ++i) {
      const double turn = 2 * std::numbers::pi * i / kAround;
      obj << "v " << std::sin(polar) * std::cos(turn) << ' ' << std::cos(polar) << ' '
          << -std::sin(polar) * std::sin(turn) << '\n';
    }
  }
  for (int j = 0; j < kRings; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const int a = j * kAround + i + 1;
      const int b = j * kAround + (i + 1) % kAround + 1;
      obj << "f " << a << ' ' << a + kAround << ' ' << b + kAround << ' ' << b << '\n';
    }
  }
  return R"(<shape type="obj"><string name="filename" value=")" +
         (folder / "ball.obj").string() + "\"/>";
}

// Against the same with flat triangles, which turn away from nobody who sees them.
TEST(RenderTest, SilhouettesOfCoarseSmoothMeshesArentBlack) {
  const nacre::testing::TempFolder folder;
  const std::string ball = CoarseBall(folder.path());
  const auto image = [&](const std::string& matter) {
    const std::string text =
        SceneText(ball + matter + "</shape>" + kFurnace + R"(<integrator type="path">
      <boolean name="hideEmitters" value="true"/></integrator>)",
                  "0, 0, 7",
                  "0, 0, 0",
                  48);
    return Render(Parse(text), With(32)).image;
  };
  for (const std::string matter :
       {R"(<bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf>)",
        R"(<subsurface type="dipole"><float name="scale" value="4"/>
           <string name="material" value="marble"/></subsurface>)"}) {
    const ExrPart smooth = image(matter);
    const ExrPart flat =
        image(matter + R"(<boolean name="faceNormals" value="true"/>)");
    for (std::size_t i = 0; i < smooth.PixelCount(); ++i) {
      EXPECT_GE(smooth.Channel(0)[i], 0.5F * flat.Channel(0)[i]) << matter << i;
    }
  }
}

TEST(RenderTest, TheCameraLooksThroughAHiddenLamp) {
  const auto seen = [](const char* lamp) {
    const Scene scene = Parse(SceneText(std::string(R"(
      <shape type="rectangle"><transform name="toWorld"><scale value="9"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>
      <emitter type="directional"><vector name="direction" x="1" y="0" z="-0.1"/>
        <rgb name="irradiance" value="10"/></emitter>)") +
                                            lamp,
                                        "0, 0, 5",
                                        "0, 0, 0",
                                        1));
    return static_cast<double>(Render(scene, With(1024)).image.values[0]);
  };
  const std::string lamp = R"(<shape type="rectangle"><transform name="toWorld">
    <translate z="1"/></transform><emitter type="area">
    <rgb name="radiance" value="7"/>HIDDEN</emitter></shape>)";
  const auto with = [&](const std::string& hidden) {
    std::string text = lamp;
    return text.replace(text.find("HIDDEN"), 6, hidden);
  };
  EXPECT_NEAR(seen(with("").c_str()), 7, 1e-4);
  const double wall = seen("");
  EXPECT_GT(wall, 0.1);
  EXPECT_NEAR(seen(with(R"(<boolean name="hidden" value="true"/>)").c_str()),
              wall,
              0.02 * wall);
}

TEST(ToneTest, ExposesAndEncodes) {
  const ExrPart image{"", 2, 1, {"R", "G", "B"}, {0.25F, 4, 0.5F, 0, 1, -1}, {}};
  const PngImage png = ToPng(image, 1);
  EXPECT_EQ(png.channel_count, 3);
  EXPECT_EQ(png.values[0], SrgbFromLinear(0.5F));
  EXPECT_EQ(png.values[1], 255);
  EXPECT_EQ(png.values[3], 255);
  EXPECT_EQ(png.values[5], 0);
  const ExrPart grey{"", 1, 1, {"Y", "A"}, {0.5F, 0.25F}, {}};
  const PngImage png2 = ToPng(grey);
  EXPECT_EQ(png2.channel_count, 2);
  EXPECT_EQ(png2.values[1], 64);
}

}  // namespace
}  // namespace nacre::render::testing

#include "render/render.h"

#include "core/fresnel.h"
#include "render/exitance_field.h"
#include "render/lit_points.h"
#include "render/tone.h"
#include "tests/render/scene_text.h"

#include <gmock/gmock.h>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;

RenderOptions With(int spp, int threads = 1) {
  RenderOptions options;
  options.spp = spp;
  options.thread_count = threads;
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

// A model that sends all light out where it came in: M = flux density of the nearest
// patches. With it, what entered must leave.
class LocalSubsurface : public Subsurface {
 public:
  explicit LocalSubsurface(std::vector<LitPoint> lit) : lit_(std::move(lit)) {}
  Color Gather(const SurfacePoint& x_o, std::int64_t&) const override {
    const LitPoint* nearest = &lit_.front();
    for (const LitPoint& point : lit_) {
      const auto distance2 = [&](const LitPoint& p) {
        const Vec3 d = p.point.position_mm - x_o.position_mm;
        return Dot(d, d);
      };
      nearest = distance2(point) < distance2(*nearest) ? &point : nearest;
    }
    return nearest->flux_density;
  }

 private:
  std::vector<LitPoint> lit_;
};

class LocalModel : public SubsurfaceModel {
 public:
  explicit LocalModel(float eta) : eta_(eta) {}
  float Eta() const override { return eta_; }
  float PatchSizeMm() const override { return 0.5F; }
  Color Rd(const SurfacePoint&, const SurfacePoint&) const override { return {}; }
  RadialDensity Spread() const override { return {}; }
  std::unique_ptr<Subsurface> Illuminate(std::vector<LitPoint> lit,
                                         int) const override {
    return std::make_unique<LocalSubsurface>(std::move(lit));
  }

 private:
  float eta_;
};

Scene WithLocalModel(const std::string& text, float eta) {
  Scene scene = Parse(text);
  scene.shapes[0].bsdf = nullptr;
  scene.shapes[0].translucency =
      Translucency{.model = std::make_shared<LocalModel>(eta),
                   .name = "local",
                   .irradiance_samples = 4096};
  return scene;
}

// In a furnace, what enters has flux π (1 − F_dr); out of it, L = M F_t / (π c) with
// c = 1 − F_dr: L_o = F_t(θ_o). Only the transmitted part of the white is missing.
TEST(RenderTest, ALosslessTranslucentSphereReturnsWhatEnteredIt) {
  for (const float eta : {1.0F, 1.5F}) {
    const Scene scene =
        WithLocalModel(SceneText(std::string(R"(<shape type="sphere"/>)") + kFurnace,
                                 "0, 0, 50",
                                 "0, 0, 0",
                                 1),
                       eta);
    Scene narrow = scene;
    narrow.camera.half_width = 1e-3F;
    RenderOptions options = With(64);
    const double radiance =
        static_cast<double>(Render(narrow, options).image.values[0]);
    EXPECT_NEAR(radiance, FresnelTransmittance(1, static_cast<double>(eta)), 0.005);
  }
}

TEST(LitPointsTest, FluxUnderADirectionalLightIsExact) {
  // Unit rectangle scaled to 6 mm a side by the object's scale of 3.
  Scene scene =
      WithLocalModel(SceneText(R"(<shape type="rectangle"/><emitter type="directional">
        <vector name="direction" x="0" y="1" z="-1"/><rgb name="irradiance" value="5"/>
        </emitter>)"),
                     1.4F);
  scene.shapes[0].translucency->mm_per_unit = 3;
  const World world(scene, 1);
  const ExitanceSources dark(1);
  const PathTracer tracer(world, dark, scene.integrator);
  const LitPoints lit = SampleLitPoints(world, 0, tracer, {});
  EXPECT_NEAR(lit.area_mm2, 36, 1e-4);
  EXPECT_NEAR(static_cast<double>(lit.points.size()), 4 * 36 / 0.25, 10);
  double area = 0;
  double flux = 0;
  for (const LitPoint& point : lit.points) {
    area += static_cast<double>(point.area_mm2);
    flux += static_cast<double>(point.area_mm2 * point.flux_density.y);
    EXPECT_LE(std::abs(point.point.position_mm.x), 3.001F);
    EXPECT_NEAR(point.point.uv.x, point.point.position_mm.x / 6 + 0.5F, 1e-5);
  }
  const double cosine = std::sqrt(0.5);
  EXPECT_NEAR(area, 36, 1e-3);
  EXPECT_NEAR(flux, 36 * 5 * cosine * FresnelTransmittance(cosine, 1.4), 1e-3 * 36);
  const LitPoints capped = SampleLitPoints(world, 0, tracer, {.max_points = 50});
  EXPECT_TRUE(capped.capped);
  EXPECT_NEAR(static_cast<double>(capped.points.size()), 50, 2);
}

TEST(LitPointsTest, PointsSpreadEvenly) {
  const Scene scene = WithLocalModel(SceneText(R"(<shape type="rectangle"/>)"), 1);
  const World world(scene, 1);
  const ExitanceSources dark(1);
  const PathTracer tracer(world, dark, scene.integrator);
  const LitPoints lit = SampleLitPoints(
      world, 0, tracer, {.points_per_patch = 16, .max_points = 1 << 20});
  // 16 patches of 0.5 mm; each must have its 16 points within a few.
  std::array<int, 16> counts{};
  for (const LitPoint& point : lit.points) {
    const int x =
        std::clamp(static_cast<int>((point.point.position_mm.x + 1) * 2), 0, 3);
    const int y =
        std::clamp(static_cast<int>((point.point.position_mm.y + 1) * 2), 0, 3);
    ++counts[static_cast<std::size_t>(4 * y + x)];
  }
  for (const int count : counts) {
    EXPECT_NEAR(count, 16, 3);
  }
}

TEST(LitPointsTest, IndirectLightComesWithThePathIntegrator) {
  // A translucent floor below a white ceiling that a light from below shines on.
  const std::string text = SceneText(R"(<shape type="rectangle"/>
    <shape type="rectangle"><transform name="toWorld"><scale value="50"/>
      <rotate x="1" angle="180"/><translate z="1"/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></shape>
    <emitter type="point"><point name="position" x="0" y="0" z="-20"/></emitter>)");
  Scene scene = WithLocalModel(text, 1);
  const World world(scene, 1);
  const ExitanceSources dark(2);
  const PathTracer tracer(world, dark, scene.integrator);
  const auto total = [&](bool indirect) {
    double flux = 0;
    for (const LitPoint& p :
         SampleLitPoints(world, 0, tracer, {.indirect = indirect}).points) {
      flux += static_cast<double>(p.flux_density.x);
    }
    return flux;
  };
  EXPECT_EQ(total(false), 0);
  EXPECT_GT(total(true), 0);
}

// An exitance that varies like a plane wave along x, in mm.
class WaveSubsurface : public Subsurface {
 public:
  Color Gather(const SurfacePoint& p, std::int64_t&) const override {
    const float v = 2 + std::sin(p.position_mm.x * 0.7F + p.position_mm.z * 0.4F);
    return {v, 2 * v, 0};
  }
};

TEST(ExitanceFieldTest, InterpolatesWithinItsSpacingOnEveryShape) {
  const std::vector<std::string> shapes = {"rectangle", "sphere", "cube", "disk"};
  for (const std::string& type : shapes) {
    Scene scene = WithLocalModel(SceneText("<shape type=\"" + type + "\"/>"), 1);
    scene.shapes[0].translucency->mm_per_unit = 10;
    const Shape& shape = scene.shapes[0];
    const ExitanceField coarse(shape, std::make_unique<WaveSubsurface>(), 0.25F, 1);
    const ExitanceField exact(shape, std::make_unique<WaveSubsurface>(), 0, 0);
    EXPECT_GT(coarse.grid_size(), 1000);
    EXPECT_EQ(exact.grid_size(), 0);
    const AreaSampler area(shape);
    PathCounters asked_coarse;
    PathCounters asked_exact;
    for (std::uint32_t i = 0; i < 2000; ++i) {
      Sampler sampler(1, i);
      const SurfaceHit hit = area.Sample(sampler.Next2D());
      const Color a = coarse.At(hit, asked_coarse);
      const Color b = exact.At(hit, asked_exact);
      // h² / 8 · |f''| = 0.0078 · 0.65, h = 0.25 along each of two directions.
      EXPECT_NEAR(a.x, b.x, 0.012F) << type;
      EXPECT_NEAR(a.y, 2 * a.x, 1e-4F);
    }
    EXPECT_EQ(asked_exact.evaluations, 2000);
  }
}

TEST(ExitanceFieldTest, AsksTheModelOnceAPoint) {
  const Scene scene = WithLocalModel(SceneText(R"(<shape type="rectangle"/>)"), 1);
  const Shape& shape = scene.shapes[0];
  const ExitanceField field(shape, std::make_unique<WaveSubsurface>(), 0.5F, 2);
  const SurfaceHit hit = MeshPoint(shape, 0, {0.31F, 0.22F});
  PathCounters asked;
  const Color first = field.At(hit, asked);
  EXPECT_EQ(asked.evaluations, 3);
  EXPECT_EQ(field.At(hit, asked), first);
  EXPECT_EQ(asked.evaluations, 3);
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

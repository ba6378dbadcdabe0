// Where light enters and leaves translucent surfaces, with a model that is transparent.
#include "render/lit_points.h"

#include "core/fresnel.h"
#include "render/exitance_field.h"
#include "tests/render/scene_text.h"

#include <gtest/gtest.h>

namespace nacre::render::testing {
namespace {

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
        WithLocalModel(SceneText(R"(<shape type="sphere"/><emitter type="constant">
          <rgb name="radiance" value="1"/></emitter>)",
                                 "0, 0, 50",
                                 "0, 0, 0",
                                 1),
                       eta);
    Scene narrow = scene;
    narrow.camera.half_width = 1e-3F;
    RenderOptions options;
    options.spp = 64;
    options.thread_count = 1;
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

}  // namespace
}  // namespace nacre::render::testing

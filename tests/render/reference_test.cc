// The fast way against the unbiased one, and finding light only where it is seen.

#include "render/lit_points.h"
#include "render/seen_places.h"
#include "render/subsurface/models.h"
#include "tests/render/scene_text.h"
#include "tests/render/subsurface/handmade_material.h"

#include <gmock/gmock.h>

namespace nacre::render::testing {
namespace {

RenderOptions With(const std::string& integrator, int spp) {
  RenderOptions options;
  options.integrator = integrator;
  options.spp = spp;
  return options;
}

const char* const kLights = R"(
  <emitter type="directional"><vector name="direction" x="1" y="-0.5" z="-1"/>
    <rgb name="irradiance" value="3"/></emitter>
  <emitter type="constant"><rgb name="radiance" value="0.2, 0.3, 0.4"/></emitter>)";

// Root of the summed squared differences of 4 x 4 blocks over that of `b`, and what the
// samples' variance makes of it.
double BlockDifference(const ExrPart& a, const ExrPart& b) {
  double difference2 = 0;
  double sum2 = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    for (int y = 0; y + 4 <= a.height; y += 4) {
      for (int x = 0; x + 4 <= a.width; x += 4) {
        double block_a = 0;
        double block_b = 0;
        for (int n = 0; n < 16; ++n) {
          const int i = (y + n / 4) * a.width + x + n % 4;
          block_a += static_cast<double>(a.Channel(c)[i]);
          block_b += static_cast<double>(b.Channel(c)[i]);
        }
        difference2 += (block_a - block_b) * (block_a - block_b);
        sum2 += block_b * block_b;
      }
    }
  }
  return std::sqrt(difference2 / sum2);
}

double FastAgainstReference(const Scene& scene, int fast_spp, int reference_spp) {
  const Rendering fast = Render(scene, With("fast", fast_spp));
  const Rendering reference = Render(scene, With("reference", reference_spp));
  EXPECT_EQ(reference.summary.bad_samples, 0);
  EXPECT_EQ(reference.summary.probes_cut, 0);
  EXPECT_GT(reference.summary.probes, 1000);
  EXPECT_EQ(reference.summary.lit_points, 0);
  return BlockDifference(fast.image, reference.image);
}

TEST(ReferenceTest, ADipolesSphereAndSlabAreAsFastHasThem) {
  for (const char* shape :
       {"<shape type=\"sphere\">",
        R"(<shape type="rectangle"><transform name="toWorld"><scale value="1.5"/>
           </transform>)"}) {
    const std::string text = SceneText(
        std::string(kLights) + shape + kDipole + "</shape>", "3, 4, 6", "0, 0, 0", 16);
    // Noise of the reference: 0.3 to 0.5 %.
    EXPECT_LT(FastAgainstReference(Parse(text), 16, 512), 0.01) << shape;
  }
}

TEST(ReferenceTest, AMeasuredMaterialOnASphereIsAsFastHasIt) {
  Scene scene = Parse(SceneText(
      std::string(kLights) + R"(<shape type="sphere">)" + kDipole + "</shape>",
      "3, 4, 6",
      "0, 0, 0",
      16));
  const std::array<DipoleProfile, 3> profiles{DipoleProfile(0.05, 1, 0.6),
                                              DipoleProfile(0.02, 2, 0.6),
                                              DipoleProfile(0.01, 2, 0.6)};
  scene.shapes[0].translucency->model =
      MakeFactored(DipoleMaterial(profiles, {.core = 19, .pitch_mm = 0.5}));
  EXPECT_LT(FastAgainstReference(scene, 16, 512), 0.015);
}

// Light that comes only by way of a wall.
TEST(ReferenceTest, IndirectLightIsTheSame) {
  const std::string text =
      SceneText(std::string(R"(<shape type="sphere">)") + kDipole + R"(</shape>
    <shape type="rectangle"><transform name="toWorld"><scale value="20"/>
      <rotate x="1" angle="180"/><translate z="8"/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.9"/></bsdf></shape>
    <shape type="rectangle"><transform name="toWorld"><scale value="3"/>
      <translate z="-3"/></transform><bsdf type="diffuse"/>
      <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>)",
                "0, 0, 6",
                "0, 0, 0",
                8);
  const Scene scene = Parse(text);
  EXPECT_LT(FastAgainstReference(scene, 64, 1024), 0.02);
}

TEST(ReferenceTest, TheSameBitsForAnyNumberOfThreads) {
  const Scene scene = Parse(
      SceneText(std::string(kLights) + R"(<shape type="cube">)" + kDipole + "</shape>",
                "3, 4, 6"));
  RenderOptions one = With("reference", 4);
  one.thread_count = 1;
  RenderOptions three = one;
  three.thread_count = 3;
  EXPECT_EQ(Render(scene, one).image.values, Render(scene, three).image.values);
}

TEST(SeenPlacesTest, DistancesAreThoseToWhatWasSeen) {
  const Scene scene = Parse(SceneText(R"(<shape type="sphere"/>)"));
  SeenPlaces seen(scene.shapes[0]);
  EXPECT_EQ(seen.seen_count(), 0);
  Sampler sampler(1, 0);
  PathCounters counters;
  std::vector<Vec3> places;
  for (const Vec3 p : {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0.6F, -0.8F, 0}}) {
    seen.At(SpherePoint(scene.shapes[0], p), {sampler, counters, Sight::kSharp});
    places.push_back(p);
  }
  // What is blurred needs no close look.
  seen.At(SpherePoint(scene.shapes[0], {0, 0, -1}),
          {sampler, counters, Sight::kBlurred});
  seen.Finish();
  EXPECT_EQ(seen.seen_count(), 3);
  const AreaSampler area(scene.shapes[0]);
  const float cell = 2.0F / 128;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const Vec3 p = area.Sample(SobolPoint(i)).position;
    float nearest = 10;
    for (const Vec3 q : places) {
      nearest = std::min(nearest, Length(p - q));
    }
    EXPECT_LE(seen.DistanceTo(p), nearest + 1e-5F);
    EXPECT_GE(seen.DistanceTo(p), nearest - 3.5F * cell);
  }
}

TEST(SeenPlacesTest, NothingSeenIsFarAway) {
  const Scene scene = Parse(SceneText(R"(<shape type="cube"/>)"));
  SeenPlaces seen(scene.shapes[0]);
  seen.Finish();
  EXPECT_TRUE(std::isinf(seen.DistanceTo({1, 1, 1})));
}

// Smaller, in millimetres, so that there are fewer points.
std::string SlabDipole() {
  std::string text = kDipole;
  text.replace(text.find("\"5\""), 3, "\"2\"");
  // Four rays a point to the sky: its noise is not what is looked at here.
  text.insert(text.find("</subsurface>"), R"(<integer name="irrSamples" value="64"/>)");
  return text;
}

// A camera close to one corner of a large slab.
std::string CornerView(const char* origin, const char* target) {
  return SceneText(std::string(kLights) + R"(<shape type="rectangle">
    <transform name="toWorld"><scale value="10"/></transform>)" +
                       SlabDipole() + "</shape>",
                   origin,
                   target,
                   16);
}

TEST(LazyTest, LightIsFoundWhereItIsSeen) {
  const Scene scene = Parse(CornerView("-8, -8, 4", "-8, -8, 0"));
  RenderOptions lazy = With("fast", 16);
  RenderOptions eager = lazy;
  eager.lazy = false;
  const Rendering a = Render(scene, lazy);
  const Rendering b = Render(scene, eager);
  EXPECT_EQ(b.summary.lit_points_skipped, 0);
  EXPECT_LT(5 * a.summary.lit_points, b.summary.lit_points);
  EXPECT_EQ(a.summary.lit_points + a.summary.lit_points_skipped, b.summary.lit_points);
  EXPECT_LT(BlockDifference(a.image, b.image), 0.004);
}

TEST(LazyTest, AMirrorCountsAsSeeing) {
  // The camera looks away from the slab, into a mirror that shows it.
  const Scene scene = Parse(SceneText(std::string(kLights) + R"(<shape type="rectangle">
    <transform name="toWorld"><scale value="10"/></transform>)" +
                                          SlabDipole() + R"(</shape>
    <shape type="rectangle"><transform name="toWorld"><scale value="20"/>
      <rotate x="1" angle="180"/><translate z="10"/></transform>
      <bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>)",
                                      "8, 8, 4",
                                      "8, 8, 10",
                                      16));
  RenderOptions lazy = With("fast", 16);
  RenderOptions eager = lazy;
  eager.lazy = false;
  const Rendering a = Render(scene, lazy);
  const Rendering b = Render(scene, eager);
  EXPECT_GT(a.summary.lit_points_skipped, 0);
  // Other points are another sample of the sky's light.
  EXPECT_LT(BlockDifference(a.image, b.image), 0.01);
}

TEST(LazyTest, AreaIsKeptWhateverIsLeftOut) {
  const Scene scene = Parse(CornerView("-8, -8, 4", "-8, -8, 0"));
  SeenPlaces seen(scene.shapes[0]);
  Sampler sampler(1, 0);
  PathCounters counters;
  seen.At(MeshPoint(scene.shapes[0], 0, {0.1F, 0.1F}),
          {sampler, counters, Sight::kSharp});
  seen.Finish();
  const World world(scene, 1);
  const ExitanceSources dark(1);
  const PathTracer tracer(world, dark, scene.integrator);
  const LitPoints lit = SampleLitPoints(world, 0, tracer, {.seen = &seen});
  EXPECT_GT(lit.skipped, 0);
  double area = 0;
  Vec3 middle;
  for (const LitPoint& point : lit.points) {
    area += static_cast<double>(point.area_mm2);
    middle += point.point.position_mm * point.area_mm2;
  }
  EXPECT_NEAR(area, 40 * 40, 0.1);
  EXPECT_LT(Length(middle) / 1600, 0.4F);  // of 40 mm
}

}  // namespace
}  // namespace nacre::render::testing

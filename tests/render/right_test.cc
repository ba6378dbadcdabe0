// The bars of "right": fast is reference, and tessellation doesn't show.

#include "core/fresnel.h"
#include "render/lit_points.h"
#include "render/subsurface/dipole_profile.h"
#include "tests/render/bias.h"
#include "tests/render/mesh_subdivision.h"
#include "tests/render/scene_text.h"

#include <gtest/gtest.h>

namespace nacre::render::testing {
namespace {

const char* const kSun = R"(
  <emitter type="directional"><vector name="direction" x="1" y="-0.5" z="-1"/>
    <rgb name="irradiance" value="3"/></emitter>)";
const char* const kPaleSky = R"(
  <integrator type="path"><boolean name="hideEmitters" value="true"/></integrator>
  <emitter type="constant"><rgb name="radiance" value="0.2, 0.3, 0.4"/></emitter>)";

ExrPart Picture(const Scene& scene, const char* integrator, int spp, int seed) {
  RenderOptions options;
  options.integrator = integrator;
  options.spp = spp;
  options.seed = static_cast<std::uint64_t>(seed);
  return Render(scene, options).image;
}

TEST(RightTest, FastIsReferenceOnSlabSphereAndCube) {
  for (const char* shape :
       {R"(<shape type="rectangle"><transform name="toWorld"><scale value="1.5"/>
           </transform>)",
        "<shape type=\"sphere\">",
        "<shape type=\"cube\">"}) {
    const Scene scene =
        Parse(SceneText(std::string(kSun) + kPaleSky + shape + kDipole + "</shape>",
                        "3, 4, 6",
                        "0, 0, 0",
                        8));
    const Difference d = Compare(Picture(scene, "fast", 256, 1),
                                 Picture(scene, "fast", 256, 2),
                                 Picture(scene, "reference", 4096, 3),
                                 Picture(scene, "reference", 4096, 4));
    EXPECT_LT(d.noise, 0.02) << shape;
    EXPECT_LT(d.bias, 0.01) << shape << " (at most " << d.bound << ")";
  }
}

// Of a half-space, all that enters leaves times the dipole's total, whichever way it
// came: L_o = Φ R F_t(η, 0) / (π c). The slab is 80 mm wide, which R_d can't leave.
TEST(RightTest, AHalfSpaceUnderEvenLightSendsBackTheIntegralOfTheDipole) {
  const char* const slab = R"(<shape type="rectangle">
    <transform name="toWorld"><scale value="40"/></transform>
    <subsurface type="dipole"><rgb name="sigmaS" value="1, 2, 3"/>
      <rgb name="sigmaA" value="0.3, 0.2, 0.2"/><float name="intIOR" value="1.5"/>
    </subsurface></shape>)";
  const double inside = DiffuseFresnelReflectance(1 / 1.5);
  const double transmitted = FresnelTransmittance(1, 1.5);
  struct Light {
    const char* text;
    double entering;
  };
  for (const Light& light :
       {Light{R"(<emitter type="constant"><rgb name="radiance" value="1"/></emitter>)",
              std::numbers::pi * ExitNormalization(1.5)},
        Light{
            R"(<emitter type="directional"><vector name="direction" x="0" y="0" z="-1"/>
                <rgb name="irradiance" value="1"/></emitter>)",
            transmitted}}) {
    Scene scene =
        Parse(SceneText(std::string(slab) + light.text, "0, 0, 50", "0, 0, 0", 4));
    scene.camera.half_width = 0.02F;
    const ExrPart image = Picture(scene, "fast", 64, 1);
    const std::array<double, 3> sigma_s{1, 2, 3};
    const std::array<double, 3> sigma_a{0.3, 0.2, 0.2};
    for (std::size_t c = 0; c < 3; ++c) {
      const double expected = light.entering *
                              DipoleProfile(sigma_a[c], sigma_s[c], inside).Total() *
                              transmitted / (std::numbers::pi * ExitNormalization(1.5));
      double mean = 0;
      for (std::size_t i = 0; i < image.PixelCount(); ++i) {
        mean += static_cast<double>(image.Channel(c)[i]) / 16;
      }
      EXPECT_NEAR(mean, expected, 0.005 * expected) << light.text << c;
    }
  }
}

TEST(RightTest, SixteenTrianglesForOneGiveTheSamePicture) {
  Scene scene = Parse(
      SceneText(std::string(kSun) + "<shape type=\"cube\">" + kDipole + "</shape>",
                "3, 4, 6",
                "0, 0, 0",
                16));
  const ExrPart coarse = Picture(scene, "fast", 16, 1);
  auto& mesh = std::get<TriangleMesh>(scene.shapes[0].geometry);
  mesh = Subdivided(Subdivided(mesh));
  ASSERT_EQ(mesh.triangles.size(), 12u * 16);
  const ExrPart fine = Picture(scene, "fast", 16, 1);
  // Noise of the lit points included; that of the film is the same in both.
  EXPECT_LT(Compare(fine, fine, coarse, coarse).total, 0.005);
}

// Light far from what is seen counts as much as if it were found closely, also where a
// triangle has neither few points nor very many.
TEST(LitPointsTest, ThinnedTrianglesKeepTheirArea) {
  Scene scene = Parse(SceneText(std::string(kSun) +
                                R"(<shape type="rectangle"><transform name="toWorld">
      <scale x="10" y="1"/></transform>)" +
                                kDipole + "</shape>"));
  auto& mesh = std::get<TriangleMesh>(scene.shapes[0].geometry);
  mesh = Subdivided(Subdivided(mesh));
  SeenPlaces seen(scene.shapes[0]);
  Sampler sampler(1, 0);
  PathCounters counters;
  SurfaceHit end;
  end.position = {-10, 0, 0};
  seen.At(end, {sampler, counters, Sight::kSharp});
  seen.Finish();
  const World world(scene, 1);
  const ExitanceSources dark(1);
  const PathTracer tracer(world, dark, scene.integrator);
  // 16 triangles for each of two, with 88 and 884 points unless they are thinned.
  for (const double points : {0.2, 2.0}) {
    const LitPoints lit =
        SampleLitPoints(world, 0, tracer, {.points_per_patch = points, .seen = &seen});
    EXPECT_GT(lit.skipped, std::ssize(lit.points));
    // Of 100 mm, the 25 next to what is seen. A point left alone in its triangle lies
    // in a corner, and on the border counts for the neighbours.
    double near = 0;
    for (const LitPoint& point : lit.points) {
      near += point.point.position_mm.x < -25 ? static_cast<double>(point.area_mm2) : 0;
    }
    EXPECT_NEAR(near / lit.area_mm2, 0.25, 0.08) << points;
  }
}

}  // namespace
}  // namespace nacre::render::testing

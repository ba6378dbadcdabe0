// A white Lambertian plane, or another simple thing, under each light: radiance known
// in closed form.
#include "tests/render/scene_text.h"

#include <gtest/gtest.h>

#include <numbers>

namespace nacre::render::testing {
namespace {

const char* const kPlane = R"(<shape type="rectangle">
  <transform name="toWorld"><scale value="100"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>)";

// Radiance of the plane's point (x, y, 0), seen from above through one pixel.
double RadianceAt(const std::string& light, const std::string& at, int spp = 256) {
  const std::string text = SceneText(kPlane + light, at + ", 40", at + ", 0", 1);
  const Scene scene =
      Parse(std::string(text).replace(text.find("value=\"20\""), 10, "value=\"0.01\""));
  RenderOptions options;
  options.spp = spp;
  options.thread_count = 1;
  return static_cast<double>(Render(scene, options).image.values[0]);
}

TEST(LightTest, PointLightFallsWithTheSquareAndTheCosine) {
  const std::string light = R"(<emitter type="point">
    <point name="position" x="0" y="0" z="2"/><rgb name="intensity" value="7"/></emitter>)";
  // L = ρ / π · I cos / r².
  EXPECT_NEAR(RadianceAt(light, "0.0001, 0", 4), 0.5 / std::numbers::pi * 7 / 4, 1e-5);
  const double r2 = 4 + 9;
  EXPECT_NEAR(RadianceAt(light, "3, 0", 4),
              0.5 / std::numbers::pi * 7 / r2 * (2 / std::sqrt(r2)),
              1e-5);
}

TEST(LightTest, SpotLightFallsLinearlyInAngleBetweenBeamAndCutoff) {
  const std::string light = R"(<emitter type="spot"><rgb name="intensity" value="9"/>
    <float name="cutoffAngle" value="45"/><float name="beamWidth" value="15"/>
    <transform name="toWorld"><lookat origin="0, 0, 3" target="0, 0, 0"/></transform>
    </emitter>)";
  const auto expected = [](double angle_deg) {
    const double cosine = std::cos(angle_deg * std::numbers::pi / 180);
    const double falloff = angle_deg < 15 ? 1 : (45 - angle_deg) / 30;
    return 0.5 / std::numbers::pi * 9 * falloff * cosine * cosine * cosine / 9;
  };
  const auto at = [](double angle_deg) {
    return std::to_string(3 * std::tan(angle_deg * std::numbers::pi / 180)) + ", 0";
  };
  for (const double angle_deg : {10.0, 30.0, 40.0}) {
    EXPECT_NEAR(RadianceAt(light, at(angle_deg), 16), expected(angle_deg), 2e-4);
  }
  EXPECT_EQ(RadianceAt(light, at(46), 16), 0);
}

TEST(LightTest, DirectionalLightFallsWithTheCosineOnly) {
  const std::string light = R"(<emitter type="directional">
    <vector name="direction" x="1" y="0" z="-1"/><rgb name="irradiance" value="4"/>
    </emitter>)";
  EXPECT_NEAR(RadianceAt(light, "20, -7", 4),
              0.5 / std::numbers::pi * 4 * std::sqrt(0.5),
              1e-5);
}

TEST(LightTest, ConstantLightGivesTheReflectance) {
  const std::string light =
      R"(<emitter type="constant"><rgb name="radiance" value="3"/></emitter>)";
  EXPECT_NEAR(RadianceAt(light, "0, 0"), 0.5 * 3, 2e-3);
}

// The form factor of a parallel disk of radius R at height h over a patch below its
// centre is R² / (R² + h²) [Howell, catalogue of configuration factors, B-13].
TEST(LightTest, AreaLightHasTheFormFactorOfADisk) {
  const std::string light = R"(<shape type="disk">
    <boolean name="flipNormals" value="true"/>
    <transform name="toWorld"><scale value="1.5"/><translate x="5" z="2"/></transform>
    <emitter type="area"><rgb name="radiance" value="6"/></emitter></shape>)";
  const std::string text = SceneText(kPlane + light, "30, 0, 9", "5, 0, 0", 1);
  const Scene scene =
      Parse(std::string(text).replace(text.find("value=\"20\""), 10, "value=\"0.01\""));
  RenderOptions options;
  options.spp = 4096;
  options.thread_count = 1;
  const double radiance = static_cast<double>(Render(scene, options).image.values[0]);
  const double form_factor = 2.25 / (2.25 + 4);
  EXPECT_NEAR(radiance, 0.5 * 6 * form_factor, 0.004 * 6);
}

// Of a sphere with its centre at height h: (R / h)² [Howell, B-43].
TEST(LightTest, AreaLightHasTheFormFactorOfASphere) {
  const std::string light = R"(<shape type="sphere"><float name="radius" value="1"/>
    <point name="center" x="5" y="0" z="3"/>
    <emitter type="area"><rgb name="radiance" value="6"/></emitter></shape>)";
  const std::string text = SceneText(kPlane + light, "30, 0, 9", "5, 0, 0", 1);
  const Scene scene =
      Parse(std::string(text).replace(text.find("value=\"20\""), 10, "value=\"0.01\""));
  RenderOptions options;
  options.spp = 1024;
  options.thread_count = 1;
  EXPECT_NEAR(static_cast<double>(Render(scene, options).image.values[0]),
              0.5 * 6 / 9.0,
              0.002);
}

TEST(LightTest, TwoLightsAddUpHoweverTheyAreChosen) {
  const std::string bright = R"(<emitter type="point">
    <point name="position" x="0" y="0" z="2"/><rgb name="intensity" value="50"/></emitter>)";
  const std::string dim = R"(<emitter type="point">
    <point name="position" x="1" y="0" z="2"/><rgb name="intensity" value="5"/>
    <float name="samplingWeight" value="5"/></emitter>)";
  const double both = RadianceAt(bright + dim, "0.001, 0", 4096);
  const double sum = RadianceAt(bright, "0.001, 0", 4) + RadianceAt(dim, "0.001, 0", 4);
  EXPECT_NEAR(both, sum, 0.01 * sum);
}

TEST(LightTest, AnOpaqueThingBetweenGivesShadow) {
  const std::string light = R"(<emitter type="point">
    <point name="position" x="10" y="0" z="10"/></emitter>)";
  const std::string blocker = R"(<shape type="sphere">
    <point name="center" x="5" y="0" z="5"/></shape>)";
  EXPECT_GT(RadianceAt(light, "0, 0", 4), 0);
  EXPECT_EQ(RadianceAt(light + blocker, "0, 0", 4), 0);
}

TEST(LightTest, LightsAreSeenDirectlyUnlessHidden) {
  const auto corner = [](const std::string& integrator) {
    const Scene scene =
        Parse(SceneText(integrator +
                        R"(<shape type="sphere"><float name="radius" value="0.5"/>
           <emitter type="area"><rgb name="radiance" value="5"/>
           </emitter></shape>
           <emitter type="constant"><rgb name="radiance" value="2"/></emitter>)"));
    RenderOptions options;
    options.spp = 4;
    const ExrPart image = Render(scene, options).image;
    return std::pair{image.values[0], image.values[8 * 4 + 4]};
  };
  EXPECT_EQ(corner(""), (std::pair{2.0F, 5.0F}));
  EXPECT_EQ(
      corner(R"(<integrator type="path"><boolean name="hideEmitters" value="true"/>
                      </integrator>)"),
      (std::pair{0.0F, 0.0F}));
}

}  // namespace
}  // namespace nacre::render::testing

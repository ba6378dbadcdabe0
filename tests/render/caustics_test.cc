// Light that glass and mirrors throw on other surfaces, by photons and by paths.

#include "tests/render/bias.h"
#include "tests/render/scene_text.h"

#include <gmock/gmock.h>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;

// A glass ball on a table under a bright square, looked at from the side.
std::string Table(const std::string& light, const std::string& ball) {
  return SceneText(R"(<integrator type="path"><integer name="maxDepth" value="8"/>
      </integrator>)" + light +
                       R"(
    <shape type="rectangle"><transform name="toWorld"><scale value="8"/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.5, 0.4"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="0" y="0" z="0.7"/>
      <float name="radius" value="0.6"/>)" +
                       ball + "</shape>",
                   "0, -6, 3",
                   "0, 0, 0.2",
                   16);
}

const char* const kGlass = R"(<bsdf type="dielectric"/>)";
const char* const kWindow = R"(<shape type="rectangle"><transform name="toWorld">
    <scale value="2.5"/><rotate x="1" angle="180"/><translate x="1" z="3.5"/></transform>
  <emitter type="area"><rgb name="radiance" value="10, 9, 8"/></emitter></shape>)";

ExrPart Picture(const std::string& xml, const char* integrator, int spp, int seed) {
  RenderOptions options;
  options.integrator = integrator;
  options.spp = spp;
  options.seed = static_cast<std::uint64_t>(seed);
  Scene scene = Parse(xml);
  scene.integrator.photons.count = 20'000;
  scene.integrator.photons.initial_radius = 0.04F;
  return Render(scene, options).image;
}

TEST(CausticsTest, PhotonsBringWhatPathsFind) {
  for (const char* ball :
       {kGlass,
        R"(<bsdf type="conductor"><string name="material" value="none"/></bsdf>)"}) {
    const std::string xml = Table(kWindow, ball);
    const Difference d = Compare(Picture(xml, "sppm", 64, 1),
                                 Picture(xml, "sppm", 64, 2),
                                 Picture(xml, "path", 1024, 3),
                                 Picture(xml, "path", 1024, 4));
    EXPECT_LT(d.bias, 0.02) << "at most " << d.bound;
    EXPECT_LT(d.noise, 0.05);
  }
}

// A point light behind glass: paths never find it, photons do. A glass ball of which
// nothing is bent (index 1) leaves the table as lit as if it weren't there.
TEST(CausticsTest, PointLightsShineThroughGlass) {
  const char* const bulb =
      R"(<emitter type="point"><point name="position" x="0" y="0" z="4"/>
      <rgb name="intensity" value="30"/></emitter>)";
  const std::string air =
      R"(<bsdf type="dielectric"><float name="intIOR" value="1.00001"/>
         <float name="extIOR" value="1"/></bsdf>)";
  const auto below = [&](const char* integrator, const std::string& ball) {
    const ExrPart image = Picture(Table(bulb, ball), integrator, 64, 1);
    // Below and before the ball, in its shadow.
    const float* const red = image.Channel(0) + 8 * 16 + 6;
    return static_cast<double>(red[0] + red[1] + red[2] + red[3]);
  };
  const double without = below("path",
                               "<bsdf type=\"dielectric\"/><transform name=\"toWorld\">"
                               "<translate x=\"50\"/></transform>");
  EXPECT_NEAR(below("sppm", air), without, 0.03 * without);
  EXPECT_LT(below("path", air), 0.5 * without);
}

TEST(CausticsTest, TheSamePictureForAnyNumberOfThreads) {
  Scene scene = Parse(Table(kWindow, kGlass));
  scene.integrator.photons.count = 10'000;
  RenderOptions options{.spp = 3, .integrator = "sppm", .thread_count = 1};
  const ExrPart one = Render(scene, options).image;
  options.thread_count = 2;
  EXPECT_EQ(one.values, Render(scene, options).image.values);
}

TEST(CausticsTest, TheSceneMayAskForThem) {
  const auto text = [](const std::string& parameters) {
    return SceneText("<integrator type=\"sppm\">" + parameters +
                     "</integrator><shape type=\"sphere\"/>" + kWindow);
  };
  const Scene scene = Parse(text(R"(<integer name="photonCount" value="1000"/>
      <float name="initialRadius" value="0.1"/><float name="alpha" value="0.8"/>
      <integer name="maxDepth" value="5"/>)"));
  EXPECT_TRUE(scene.integrator.photons.enabled);
  EXPECT_EQ(scene.integrator.photons.count, 1000);
  EXPECT_EQ(scene.integrator.photons.alpha, 0.8F);
  EXPECT_EQ(scene.integrator.max_depth, 5);
  EXPECT_THAT(ReaderError(text(R"(<float name="alpha" value="2"/>)")),
              HasSubstr("alpha"));
  EXPECT_THAT(ReaderError(text(R"(<float name="photonCnt" value="2"/>)")),
              HasSubstr("did you mean 'photonCount'?"));
  EXPECT_THROW(Render(scene, {.spp = 4, .sampling = "adaptive"}), Error);
}

}  // namespace
}  // namespace nacre::render::testing

// Light from pictures: environments and slide projectors.

#include "render/environment.h"

#include "core/exr.h"
#include "render/world.h"
#include "tests/render/scene_text.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;

const Frame kUpright{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};

// Random, with one pixel far brighter than the rest.
Bitmap Sky(int width, int height) {
  Bitmap sky{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    Sampler sampler(7, static_cast<std::uint32_t>(i));
    const Vec2 u = sampler.Next2D();
    sky.pixels.push_back({u.x, u.y, 0.5F});
  }
  sky.pixels[static_cast<std::size_t>(width * (height / 3) + 2)] = {80, 90, 70};
  return sky;
}

TEST(EnvironmentTest, DirectionsAreThoseOfMitsuba) {
  Bitmap picture{4, 2, std::vector<Color>(8, Color{0, 0, 0})};
  picture.pixels[1] = {1, 0, 0};  // from a quarter to half: between +x and +z, above
  const Environment sky(picture, kUpright, 2);
  const Vec3 there = Normalized({1, 1.4142F, 1});
  EXPECT_NEAR(sky.Radiance(there).x, 2, 1e-4F);
  EXPECT_LT(sky.Radiance(Normalized({-1, 1.4142F, -1})).x, 1e-4F);
  EXPECT_LT(sky.Radiance(Normalized({1, -1.4142F, 1})).x, 1e-4F);
}

TEST(EnvironmentTest, SamplesAreDistributedAsTheySay) {
  const Environment sky(Sky(16, 8), kUpright, 1);
  constexpr std::uint32_t kCount = 1 << 16;
  Color by_light;      // ∫ L by sampling L,
  Color by_sphere;     // and by sampling evenly
  double pdf_sum = 0;  // ∫ pdf
  for (std::uint32_t i = 0; i < kCount; ++i) {
    Vec2 u = SobolPoint(i);
    u.x += 0.5F / kCount;  // the pole itself has no density
    const Environment::Sample sample = sky.SampleDirection(u);
    EXPECT_NEAR(sky.Pdf(sample.direction) / sample.pdf, 1, 0.02F) << i;
    by_light += sky.Radiance(sample.direction) / (sample.pdf * kCount);
    const Vec3 even{std::sqrt(1 - (2 * u.x - 1) * (2 * u.x - 1)) *
                        std::cos(2 * std::numbers::pi_v<float> * u.y),
                    2 * u.x - 1,
                    std::sqrt(1 - (2 * u.x - 1) * (2 * u.x - 1)) *
                        std::sin(2 * std::numbers::pi_v<float> * u.y)};
    const float weight = 4 * std::numbers::pi_v<float> / kCount;
    by_sphere += sky.Radiance(even) * weight;
    pdf_sum += static_cast<double>(sky.Pdf(even) * weight);
  }
  EXPECT_NEAR(pdf_sum, 1, 0.01);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(by_light[c], by_sphere[c], 0.005F * by_sphere[c]);
  }
}

void WritePicture(const std::filesystem::path& path, const Bitmap& bitmap) {
  ExrPart part{"", bitmap.width, bitmap.height, {"R", "G", "B"}, {}, {}};
  for (int c = 0; c < 3; ++c) {
    for (const Color& pixel : bitmap.pixels) {
      part.values.push_back(pixel[c]);
    }
  }
  WriteExr(path, {part});
}

std::string EnvironmentXml(const std::filesystem::path& path) {
  return R"(<emitter type="envmap"><string name="filename" value=")" + path.string() +
         R"("/></emitter>)";
}

// The same picture of a diffuse sphere whether its sky's bright spot is found by
// sampling it or, with little weight to it, by chance: and so for any other light.
TEST(EnvironmentTest, LightsADiffusePlaneByItsIntegral) {
  const nacre::testing::TempFolder folder;
  const Bitmap picture = Sky(16, 8);
  WritePicture(folder / "sky.exr", picture);
  const Rendering r = Render(Parse(SceneText(EnvironmentXml(folder / "sky.exr") + R"(
    <shape type="rectangle"><transform name="toWorld"><rotate x="1" angle="-90"/>
      <scale value="9"/></transform><bsdf type="diffuse">
      <rgb name="reflectance" value="0.5"/></bsdf></shape>)",
                                             "0, 5, 0.01")),
                             {.spp = 256});
  const Environment sky(picture, kUpright, 1);
  double irradiance = 0;
  constexpr std::uint32_t kCount = 1 << 16;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Environment::Sample sample = sky.SampleDirection(SobolPoint(i));
    irradiance += static_cast<double>(sky.Radiance(sample.direction).y *
                                      std::max(0.0F, sample.direction.y) / sample.pdf) /
                  kCount;
  }
  const double expected = 0.5 * irradiance / std::numbers::pi;
  EXPECT_NEAR(ChannelStatistics(r.image, 1).mean, expected, 0.005 * expected);
}

TEST(EnvironmentTest, IsSeenBehindEverything) {
  const nacre::testing::TempFolder folder;
  WritePicture(folder / "grey.exr",
               {2, 1, std::vector<Color>(2, Color{0.25F, 0.5F, 0.75F})});
  const Rendering r = Render(Parse(SceneText(EnvironmentXml(folder / "grey.exr") + R"(
    <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="1"/>
      </bsdf></shape>)")),
                             {.spp = 64});
  for (std::size_t c = 0; c < 3; ++c) {
    const Statistics s = ChannelStatistics(r.image, c);
    EXPECT_NEAR(s.mean, 0.25 * static_cast<double>(c + 1), 0.003);
  }
}

// What a projector throws on a plane across its axis, a camera in its place sees as the
// slide: cosines and distances cancel.
TEST(ProjectorTest, ACameraInItsPlaceSeesTheSlide) {
  const nacre::testing::TempFolder folder;
  Bitmap slide{4, 4, {}};
  for (int i = 0; i < 16; ++i) {
    slide.pixels.push_back({static_cast<float>(i), 1, i == 2 ? 9.0F : 0.0F});
  }
  WritePicture(folder / "slide.exr", slide);
  const Rendering r = Render(Parse(SceneText(R"(
    <emitter type="projector"><float name="fov" value="20"/><float name="scale" value="3"/>
      <transform name="toWorld"><lookat origin="0, 0, 1" target="0, 0, 0" up="0, 1, 0"/>
      </transform><texture name="irradiance" type="bitmap">
        <string name="filename" value=")" + (folder / "slide.exr").string() +
                                                 R"("/>
        <string name="filterType" value="nearest"/></texture></emitter>
    <shape type="rectangle"><bsdf type="diffuse"><rgb name="reflectance" value="0.8"/>
      </bsdf></shape>)",
                                             "0, 0, 1",
                                             "0, 0, 0",
                                             8)),
                             {.spp = 4});
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const float expected = 0.8F * 3 / std::numbers::pi_v<float> *
                             static_cast<float>(4 * (y / 2) + x / 2);
      EXPECT_NEAR(r.image.Channel(0)[y * 8 + x], expected, 1e-3F * expected + 1e-6F)
          << x << " " << y;
    }
  }
}

TEST(ProjectorTest, LightsATranslucentObjectOnlyInsideItsPicture) {
  const Scene scene = Parse(SceneText(R"(
    <emitter type="projector"><float name="fov" value="10"/>
      <transform name="toWorld"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/>
      </transform></emitter><shape type="rectangle"/>)"));
  const World world(scene, 1);
  const float edge = 5 * std::tan(5 * std::numbers::pi_v<float> / 180);
  EXPECT_GT(world.SampleLight(0, {0.99F * edge, 0, 0}, {0, 0, 1}, {}).pdf, 0);
  EXPECT_EQ(world.SampleLight(0, {1.01F * edge, 0, 0}, {0, 0, 1}, {}).pdf, 0);
  EXPECT_EQ(world.SampleLight(0, {0, 0, 6}, {0, 0, 1}, {}).pdf, 0);
  // E = 1 at distance 1, 1/25 at distance 5.
  EXPECT_NEAR(world.SampleLight(0, {0, 0, 0}, {0, 0, 1}, {}).radiance.x, 0.04F, 1e-6F);
}

TEST(EnvironmentTest, ErrorsNameTheParameter) {
  EXPECT_THAT(ReaderError(SceneText(R"(<emitter type="envmap"/>)")),
              HasSubstr("envmap needs a <string name=\"filename\">"));
  EXPECT_THAT(ReaderError(SceneText(R"(<emitter type="envmap"><transform name="toWorld">
    <scale x="1" y="2" z="1"/><rotate x="1" y="1" angle="30"/><scale x="3"/></transform>
    </emitter>)")),
              HasSubstr("only be turned and mirrored"));
  EXPECT_THAT(ReaderError(SceneText(R"(<emitter type="projector">
    <float name="fov" value="190"/></emitter>)")),
              HasSubstr("fov"));
}

}  // namespace
}  // namespace nacre::render::testing

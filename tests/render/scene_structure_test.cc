// Scenes of several files, and shapes that are there several times.
#include "render/warp.h"
#include "tests/render/scene_text.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <fstream>

namespace nacre::render::testing {
namespace {

using nacre::testing::TempFolder;
using ::testing::HasSubstr;

class IncludeTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
  }
  Scene Read(const std::string& name) const { return ReadScene(folder_.path() / name); }
  std::string ErrorOf(const std::string& name) const {
    try {
      Read(name);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }

  TempFolder folder_;
};

TEST_F(IncludeTest, StandsForWhatIsInTheFile) {
  Write("paint.xml", R"(<scene><default name="size" value="3"/>
    <bsdf type="diffuse" id="paint"/></scene>)");
  Write("main.xml", SceneText(R"(<include filename="paint.xml"/>
    <shape type="sphere"><float name="radius" value="$size"/><ref id="paint"/></shape>)"));
  const Scene scene = Read("main.xml");
  ASSERT_EQ(scene.shapes.size(), 1);
  EXPECT_EQ(std::get<Sphere>(scene.shapes[0].geometry).radius, 3);
  EXPECT_NE(scene.shapes[0].bsdf, nullptr);
  EXPECT_EQ(scene.files.size(), 2);  // both are hashed into the picture's provenance
}

TEST_F(IncludeTest, ErrorsNameTheFileTheyAreIn) {
  Write("inner.xml", "<scene>\n<shape type=\"spere\"/></scene>");
  Write("main.xml", SceneText("<include filename=\"inner.xml\"/>"));
  EXPECT_THAT(ErrorOf("main.xml"), HasSubstr("inner.xml:2: no shape 'spere'"));
  Write("main.xml",
        SceneText("<include filename=\"inner.xml\"/>\n<shape type=\"cub\"/>"));
  Write("inner.xml", "<scene/>");
  EXPECT_THAT(ErrorOf("main.xml"), HasSubstr("main.xml:12: no shape 'cub'"));
}

TEST_F(IncludeTest, ScenesReadNothingOutsideTheirFolder) {
  std::filesystem::create_directories(folder_ / "scene");
  Write("secret.xml", "<scene/>");
  Write("scene/near.xml", "<scene/>");
  const std::filesystem::path secret = folder_ / "secret.xml";
  std::filesystem::create_symlink(secret, folder_ / "scene/link.xml");
  const auto scene = [&](const std::string& file) {
    Write("scene/main.xml", SceneText("<include filename=\"" + file + "\"/>"));
    return ErrorOf("scene/main.xml");
  };
  EXPECT_EQ(scene("near.xml"), "no error");
  EXPECT_EQ(scene("../scene/near.xml"), "no error");
  for (const std::string& file :
       {std::string("../secret.xml"), secret.string(), std::string("link.xml")}) {
    EXPECT_THAT(scene(file), HasSubstr("isn't in the scene's folder")) << file;
    EXPECT_THAT(scene(file), HasSubstr("main.xml:11")) << file;
    const auto path = folder_ / "scene/main.xml";
    EXPECT_NO_THROW(ReadScene(path, {.allow_outside = true}));
    EXPECT_NO_THROW(ReadScene(path, {.defines = {{"by", secret.string()}}}));
  }
  // Materials are looked for by name in several folders, but not above these.
  Write("sample.nacre.exr", "");
  for (const std::string& name :
       {std::string("../sample"), (folder_ / "sample.nacre.exr").string()}) {
    Write("scene/main.xml",
          SceneText(R"(<shape type="rectangle"><subsurface type="svd">
            <string name="material" value=")" +
                    name + "\"/></subsurface></shape>"));
    EXPECT_THAT(ErrorOf("scene/main.xml"), HasSubstr("isn't in the scene's folder"));
  }
}

TEST_F(IncludeTest, RefusesCyclesLongChainsAndASecondSensor) {
  Write("a.xml", "<scene><include filename=\"b.xml\"/></scene>");
  Write("b.xml", "<scene>\n<include filename=\"a.xml\"/></scene>");
  Write("main.xml", SceneText("<include filename=\"a.xml\"/>"));
  EXPECT_THAT(ErrorOf("main.xml"), HasSubstr("b.xml:2: 'a.xml' includes itself"));
  for (int k = 0; k < 20; ++k) {
    Write("c" + std::to_string(k) + ".xml",
          "<scene><include filename=\"c" + std::to_string(k + 1) + ".xml\"/></scene>");
  }
  Write("main.xml", SceneText("<include filename=\"c0.xml\"/>"));
  EXPECT_THAT(ErrorOf("main.xml"), HasSubstr("more than 16 files"));
  Write("view.xml", "<scene><sensor type=\"perspective\"/></scene>");
  Write("main.xml", SceneText("<include filename=\"view.xml\"/>"));
  EXPECT_THAT(ErrorOf("main.xml"), HasSubstr("view.xml:1: a second <sensor>"));
}

// A quarter turn takes (u, v) to (−v, u), then u is doubled.
TEST(TextureTransformTest, TurnsBeforeItScales) {
  const Scene scene = Parse(SceneText(R"(<shape type="cube"><bsdf type="diffuse">
    <texture type="checkerboard" name="reflectance"><rgb name="color0" value="1"/>
    <rgb name="color1" value="0"/><float name="uscale" value="2"/>
    <transform name="toUV"><rotate z="1" angle="90"/></transform></texture>
    </bsdf></shape>)"));
  const auto reflectance = [&](Vec2 uv) {
    return scene.shapes[0].bsdf->Evaluate({0, 0, 1}, {0, 0, 1}, uv).value.x * kPi;
  };
  // ⌊2u'⌋ + ⌊2v'⌋ with u' = −2v, v' = u.
  EXPECT_NEAR(reflectance({0.2F, 0.1F}), 0, 1e-6);  // −1 + 0
  EXPECT_NEAR(reflectance({0.2F, 0.3F}), 1, 1e-6);  // −2 + 0
  EXPECT_NEAR(reflectance({0.7F, 0.1F}), 1, 1e-6);  // −1 + 1
}

const char* const kPointLight = R"(<emitter type="point">
  <point name="position" x="2" y="3" z="8"/><rgb name="intensity" value="50"/></emitter>)";

double Difference(const ExrPart& a, const ExrPart& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    most = std::max(most, std::abs(static_cast<double>(a.values[i] - b.values[i])));
  }
  return most;
}

ExrPart PictureOf(const std::string& shapes) {
  RenderOptions options;
  options.spp = 16;
  return Render(Parse(SceneText(kPointLight + shapes, "0, 0, 12", "0, 0, 0", 24)),
                options)
      .image;
}

// A cube and a ball, as they are and moved, mirrored and stretched.
TEST(InstanceTest, IsThePictureOfShapesWrittenOut) {
  const std::string first = "<rotate z=\"1\" angle=\"30\"/><translate x=\"-1.2\"/>";
  const std::string second =
      "<scale x=\"-0.5\" y=\"0.5\" z=\"0.5\"/><translate x=\"1.2\" y=\"0.4\"/>";
  const auto shapes = [](const std::string& more) {
    return R"(<shape type="cube"><transform name="toWorld"><scale value="0.6"/>)" +
           more +
           R"(</transform></shape><shape type="sphere"><float name="radius" value="0.4"/>
           <transform name="toWorld"><translate z="0.8" y="0.3"/>)" +
           more + "</transform></shape>";
  };
  const auto instance = [](const std::string& transform) {
    return R"(<shape type="instance"><ref id="both"/><transform name="toWorld">)" +
           transform + "</transform></shape>";
  };
  const ExrPart written = PictureOf(shapes(first) + shapes(second));
  const ExrPart instanced =
      PictureOf("<shape type=\"shapegroup\" id=\"both\">" + shapes("") + "</shape>" +
                instance(first) + instance(second));
  EXPECT_GT(*std::max_element(written.values.begin(), written.values.end()), 0.1F);
  EXPECT_LT(Difference(written, instanced), 2e-3);
}

TEST(InstanceTest, TranslucentShapesAreCopied) {
  const Scene scene = Parse(SceneText(R"(<shape type="shapegroup" id="candles">
    <shape type="sphere"><subsurface type="dipole"><string name="material" value="Marble"/>
    </subsurface></shape></shape>
    <shape type="instance"><ref id="candles"/></shape>
    <shape type="instance"><ref id="candles"/><transform name="toWorld">
      <scale value="2"/><translate x="5"/></transform></shape>)"));
  ASSERT_EQ(scene.shapes.size(), 2);
  EXPECT_EQ(std::get<Sphere>(scene.shapes[1].geometry).radius, 2);
  EXPECT_EQ(std::get<Sphere>(scene.shapes[1].geometry).center.x, 5);
  EXPECT_TRUE(scene.instances.empty());
}

TEST(InstanceTest, WrongOnesAreNamed) {
  const auto error = [](const std::string& body) {
    return ReaderError(SceneText(body));
  };
  EXPECT_THAT(error("<shape type=\"instance\"><ref id=\"x\"/></shape>"),
              HasSubstr("no shapegroup with id 'x'"));
  EXPECT_THAT(error("<shape type=\"shapegroup\"><shape type=\"cube\"/></shape>"),
              HasSubstr("a shapegroup needs an id"));
  EXPECT_THAT(error("<shape type=\"shapegroup\" id=\"a\"/>"),
              HasSubstr("a shapegroup without a shape"));
  EXPECT_THAT(error("<shape type=\"shapegroup\" id=\"a\"><shape type=\"cube\">"
                    "<emitter type=\"area\"/></shape></shape>"),
              HasSubstr("that shines"));
}

}  // namespace
}  // namespace nacre::render::testing

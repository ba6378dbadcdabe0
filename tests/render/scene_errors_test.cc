// What the reader of scenes says to what is wrong.
#include "core/exr.h"
#include "tests/render/scene_text.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <fstream>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The body starts at this line of SceneText.
constexpr int kBodyLine = 11;

std::string BodyError(const std::string& body) {
  return ReaderError(SceneText(body));
}

TEST(SceneErrorsTest, UnknownWordsAreErrorsWithTheLineAndTheNearestWord) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"<shap type=\"cube\"/>",
       "test.xml:11: no element <shap> in a <scene>; did you "
       "mean 'shape'?"},
      {"\n\n<shape type=\"cubus\"/>",
       "test.xml:13: no shape 'cubus'; did you mean 'cube'?"},
      {"<shape type=\"sphere\">\n<float name=\"radious\" value=\"1\"/></shape>",
       "test.xml:12: <shape type=\"sphere\"> has no parameter 'radious'; did you mean "
       "'radius'?"},
      {"<shape type=\"cube\"><bsdf type=\"rougplastic\"/></shape>",
       "no bsdf 'rougplastic'; did you mean 'roughplastic'?"},
      {"<shape type=\"cube\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" "
       "type=\"bitmp\"/></bsdf></shape>",
       "no texture 'bitmp'; did you mean 'bitmap'?"},
      {"<emitter type=\"sunsky\"/>", "no emitter 'sunsky'; known are point, spot"},
      {"<shape type=\"cube\"><subsurface type=\"dipol\"/></shape>",
       "no subsurface 'dipol'; did you mean 'dipole'?"},
      {"<shape type=\"cube\"><floatt name=\"x\" value=\"1\"/></shape>",
       "no element <floatt>; did you mean 'float'?"},
      {"<shape type=\"cube\"><film type=\"hdrfilm\"/></shape>",
       "a <film> has no place in a <shape>"},
      {"<integrator type=\"bdpt\"/>",
       "no integrator 'bdpt'; known are path, volpath, volpath_simple, direct"},
      {"<shape type=\"cube\"><transform name=\"toWorld\"><rotat x=\"1\"/></transform>"
       "</shape>",
       "no transform <rotat>; did you mean 'rotate'?"},
      {"<shape type=\"cube\"><bsdf type=\"roughplastic\"><string name=\"distribution\" "
       "value=\"gxx\"/></bsdf></shape>",
       "no distribution 'gxx'; did you mean 'ggx'?"},
      {"<shape type=\"cube\"><bsdf type=\"conductor\"><string name=\"material\" "
       "value=\"Ax\"/></bsdf></shape>",
       "no metal 'Ax'; did you mean 'Ag'?"},
      {"<shape type=\"cube\"><bsdf type=\"plastic\"><string name=\"intIOR\" "
       "value=\"watr\"/></bsdf></shape>",
       "no substance 'watr'; did you mean 'water'?"},
      {"<shape type=\"cube\"><subsurface type=\"dipole\"><string name=\"material\" "
       "value=\"marbel\"/></subsurface></shape>",
       "no medium 'marbel' in the tables of Jensen et al. 2001 and Narasimhan et al. "
       "2006; did you mean 'marble'?"}};
  for (const auto& [body, message] : cases) {
    EXPECT_THAT(BodyError(body), HasSubstr(message)) << body;
  }
}

TEST(SceneErrorsTest, WrongValuesAreErrorsAtTheirLine) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"<shape type=\"sphere\">\n<float name=\"radius\" value=\"1x\"/></shape>",
       "test.xml:12: '1x' isn't a finite number"},
      {"<shape type=\"sphere\"><float name=\"radius\" value=\"nan\"/></shape>",
       "'nan' isn't a finite number"},
      {"<shape type=\"sphere\"><float name=\"radius\" value=\"1e300\"/></shape>",
       "'1e300' isn't a finite number"},
      {"<shape type=\"sphere\"><float name=\"radius\" value=\"-1\"/></shape>",
       "'radius' is -1; it must be in"},
      {"<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>",
       "'radius' is a <string>; it must be a <float>"},
      {"<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/><float "
       "name=\"radius\" value=\"2\"/></shape>",
       "'radius' is given twice"},
      {"<shape type=\"sphere\"><float name=\"radius\"/></shape>",
       "<float> needs the attribute 'value'"},
      {"<shape type=\"sphere\"><float value=\"1\"/></shape>", "<float> needs a name"},
      {"<shape type=\"sphere\">radius</shape>", "text inside <shape>: 'radius'"},
      {"<shape/>", "<shape> needs the attribute 'type'"},
      {"<shape type=\"sphere\"><boolean name=\"flipNormals\" value=\"yes\"/></shape>",
       "'yes' is neither true nor false"},
      {"<shape type=\"sphere\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" "
       "value=\"1, 2\"/></bsdf></shape>",
       "a colour needs one or three numbers, not 2"},
      {"<shape type=\"sphere\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" "
       "value=\"0.1, -0.2, 0\"/></bsdf></shape>",
       "a colour below 0"},
      {"<shape type=\"sphere\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" "
       "value=\"1.5\"/></bsdf></shape>",
       "'reflectance' reaches 1.5: above 1 it would make light"},
      {"<shape type=\"sphere\"><bsdf type=\"diffuse\"><spectrum name=\"reflectance\" "
       "value=\"400:1 700:0\"/></bsdf></shape>",
       "spectra by wavelength"},
      {"<shape type=\"sphere\"><bsdf type=\"diffuse\"><srgb name=\"reflectance\" "
       "value=\"#12345\"/></bsdf></shape>",
       "'#12345' isn't a colour like #8040ff"},
      {"<shape type=\"cube\"><transform name=\"toWorld\"><matrix value=\"1 2 3\"/>"
       "</transform></shape>",
       "a matrix needs 16 numbers, not 3"},
      {"<shape type=\"cube\"><transform name=\"toWorld\"><scale z=\"0\"/></transform>"
       "</shape>",
       "the transform flattens the shape"},
      {"<shape type=\"cube\"><transform name=\"toWorld\">\n<lookat origin=\"0,0,0\" "
       "target=\"0,1,0\" up=\"0,1,0\"/></transform></shape>",
       "test.xml:12: lookat: up is parallel"},
      {"<shape type=\"sphere\"><transform name=\"toWorld\"><scale x=\"2\"/></transform>"
       "</shape>",
       "a sphere can only be moved, turned and scaled evenly"},
      {"<shape type=\"obj\"/>", "a mesh needs a <string name=\"filename\">"},
      {"<shape type=\"obj\"><string name=\"filename\" value=\"no.obj\"/></shape>",
       "no file './no.obj'; paths start at the scene's folder"},
      {"<emitter type=\"area\"/>", "an area light belongs inside the shape"},
      {"<emitter type=\"spot\"><float name=\"beamWidth\" value=\"30\"/></emitter>",
       "'beamWidth' is 30; it must be in [0, 20]"},
      {"<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"0\" "
       "z=\"0\"/></emitter>",
       "a direction of length 0"},
      {"<shape type=\"cube\"><bsdf type=\"twosided\"/></shape>",
       "twosided needs one bsdf, not 0"},
      {"<shape type=\"cube\"><bsdf type=\"plastic\"><float name=\"intIOR\" "
       "value=\"0.9\"/></bsdf></shape>",
       "higher index inside"},
      {"<shape type=\"cube\"><subsurface type=\"dipole\"/></shape>",
       "give one of: 'material'"},
      {"<shape type=\"cube\"><subsurface type=\"svd\"/></shape>",
       "svd needs a <string name=\"material\">"},
      {"<integrator type=\"path\"><integer name=\"maxDepth\" "
       "value=\"0\"/></integrator>",
       "maxDepth is -1 (no limit) or at least 1"},
      {"<integrator type=\"path\"><integer name=\"maxDepth\" "
       "value=\"2.5\"/></integrator>",
       "2.5 isn't a whole number"},
      {"<sensor type=\"perspective\"/>", "a second <sensor>"}};
  for (const auto& [body, message] : cases) {
    EXPECT_THAT(BodyError(body), HasSubstr(message)) << body;
  }
}

TEST(SceneErrorsTest, FilmsOfImpossibleSizeAreRefused) {
  const auto film = [](const std::string& parameters) {
    return ReaderError(
        "<scene><sensor type=\"perspective\"><float name=\"fov\" "
        "value=\"40\"/><film type=\"hdrfilm\">" +
        parameters + "</film></sensor></scene>");
  };
  const auto integer = [](const std::string& name, const std::string& value) {
    return "<integer name=\"" + name + "\" value=\"" + value + "\"/>";
  };
  EXPECT_THAT(film(integer("width", "0")), HasSubstr("'width' is 0"));
  EXPECT_THAT(film(integer("width", "100000")), HasSubstr("'width' is 100000"));
  EXPECT_THAT(film(integer("width", "60000") + integer("height", "60000")),
              HasSubstr("at most 268435456"));
  EXPECT_THAT(film(integer("cropOffsetX", "700") + integer("cropWidth", "100")),
              HasSubstr("isn't inside the film of 768 x 576"));
  EXPECT_THAT(film("<string name=\"pixelFormat\" value=\"rbg\"/>"),
              HasSubstr("no pixelFormat 'rbg'; did you mean 'rgb'?"));
  EXPECT_THAT(film("<rfilter type=\"gauss\"/>"), HasSubstr("did you mean 'gaussian'?"));
}

TEST(SceneErrorsTest, WhatIsNotASceneIsRefused) {
  EXPECT_THAT(ReaderError("<scene>\n<shape type=\"cube\"\n</scene>"),
              HasSubstr("not XML"));
  EXPECT_THAT(ReaderError("<other/>"), HasSubstr("no <scene> in it"));
  EXPECT_THAT(ReaderError("<scene/>"), HasSubstr("a scene needs a <sensor>"));
  EXPECT_THAT(ReaderError(""), HasSubstr("test.xml:1"));
}

TEST(SceneErrorsTest, EveryCutOffSceneIsRefused) {
  const std::string whole = SceneText(
      "<shape type=\"sphere\"><bsdf type=\"plastic\"/></shape><emitter "
      "type=\"point\"/>");
  for (std::size_t size = 0; size + 2 < whole.size(); size += 3) {
    EXPECT_NE(ReaderError(whole.substr(0, size)), "no error") << size;
  }
}

TEST(SceneErrorsTest, LenientTurnsUnknownWordsIntoNotes) {
  const Scene scene = Parse(SceneText(R"(
  <fog type="homogeneous" id="m"/>
  <shape type="sphere"><float name="radious" value="1"/><bsdf type="phong"/></shape>
  <shape type="hair"/>)"),
                            {.lenient = true});
  EXPECT_EQ(scene.shapes.size(), 1u);
  EXPECT_NE(scene.shapes[0].bsdf, nullptr);
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("'radious'")));
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("no bsdf 'phong'")));
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("no shape 'hair'")));
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("<fog>")));
  // A wrong value stays an error.
  EXPECT_THAT(ReaderError(SceneText("<shape type=\"sphere\"><float name=\"radius\" "
                                    "value=\"x\"/></shape>"),
                          {.lenient = true}),
              HasSubstr("isn't a finite number"));
}

TEST(SceneErrorsTest, BadTexturesAreRefused) {
  const nacre::testing::TempFolder folder;
  std::ofstream(folder / "t.jpg") << "x";
  std::ofstream(folder / "t.png") << "not a picture";
  ExrPart exr{"", 2, 1, {"R", "G", "B"}, {0, 0, 0, -1, 0, 0}, {}};
  WriteExr(folder / "t.exr", {exr});
  const auto error = [&](const std::string& parameters) -> std::string {
    try {
      ParseScene(SceneText("<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture "
                           "name=\"reflectance\" type=\"bitmap\">" +
                           parameters + "</texture></bsdf></shape>"),
                 "s.xml",
                 folder.path());
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  const auto file = [](const std::string& name) {
    return "<string name=\"filename\" value=\"" + name + "\"/>";
  };
  EXPECT_THAT(error(""), HasSubstr("bitmap needs"));
  EXPECT_THAT(error(file("t.jpg")), HasSubstr("neither .png nor .exr: convert it"));
  EXPECT_THAT(error(file("t.png")), HasSubstr("t.png"));
  EXPECT_THAT(error(file("t.exr")),
              HasSubstr("pixel (1, 0) is negative or not finite"));
  EXPECT_THAT(error(file("t.exr") + "<string name=\"wrapMode\" value=\"repet\"/>"),
              HasSubstr("did you mean 'repeat'?"));
  EXPECT_THAT(error(file("t.exr") + "<float name=\"gamma\" value=\"-2\"/>"),
              HasSubstr("gamma must be above 0"));
}

}  // namespace
}  // namespace nacre::render::testing

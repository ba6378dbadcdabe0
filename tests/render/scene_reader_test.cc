#include "core/exr.h"
#include "core/png.h"
#include "factor/material.h"
#include "render/preset_path.h"
#include "tests/render/scene_text.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(SceneReaderTest, ComposesTransformsFromTopToBottom) {
  const Scene scene = Parse(SceneText(R"(<shape type="sphere">
  <transform name="toWorld">
    <translate x="1"/><rotate z="1" angle="90"/><scale value="2"/><translate z="-3"/>
    <matrix value="1 0 0 0  0 1 0 0.5  0 0 1 0  0 0 0 1"/>
  </transform></shape>)"));
  const auto& sphere = std::get<Sphere>(scene.shapes[0].geometry);
  EXPECT_NEAR(sphere.center.x, 0, 1e-6);
  EXPECT_NEAR(sphere.center.y, 2.5, 1e-6);
  EXPECT_NEAR(sphere.center.z, -3, 1e-6);
  EXPECT_NEAR(sphere.radius, 2, 1e-6);
}

TEST(SceneReaderTest, ReplacesNamesByDefinesBeforeDefaults) {
  const std::string text = SceneText(R"(<default name="r" value="3"/>
  <default name="unit" value="1"/>
  <shape type="sphere"><float name="radius" value="$r"/>
  <point name="center" x="$unit" y="-$unit" z="$unit.5"/></shape>)");
  EXPECT_EQ(std::get<Sphere>(Parse(text).shapes[0].geometry).radius, 3);
  const Scene defined = Parse(text, {.defines = {{"r", "5"}}});
  EXPECT_EQ(std::get<Sphere>(defined.shapes[0].geometry).radius, 5);
  EXPECT_EQ(std::get<Sphere>(defined.shapes[0].geometry).center, (Vec3{1, -1, 1.5F}));
  EXPECT_THAT(
      ReaderError(SceneText("<default name=\"size\" value=\"1\"/>\n"
                            "<shape type=\"sphere\"><float name=\"radius\" "
                            "value=\"$sise\"/></shape>")),
      HasSubstr("test.xml:12: $sise has no value: give -D sise=… or a <default> above; "
                "did you mean 'size'?"));
}

TEST(SceneReaderTest, ReadsFilmSamplerAndIntegrator) {
  const Scene scene = Parse(R"(<scene version="0.5.0">
  <integrator type="path"><integer name="maxDepth" value="7"/>
    <boolean name="hideEmitters" value="true"/></integrator>
  <sensor type="perspective"><float name="fov" value="90"/>
    <string name="fovAxis" value="y"/>
    <sampler type="ldsampler"><integer name="sampleCount" value="33"/></sampler>
    <film type="ldrfilm"><integer name="width" value="40"/>
      <integer name="height" value="20"/><integer name="cropOffsetX" value="5"/>
      <integer name="cropWidth" value="10"/><string name="pixelFormat" value="rgba"/>
      <boolean name="banner" value="false"/>
      <rfilter type="mitchell"><float name="B" value="0.5"/></rfilter></film>
  </sensor></scene>)");
  EXPECT_EQ(scene.integrator.max_depth, 7);
  EXPECT_TRUE(scene.integrator.hide_emitters);
  EXPECT_EQ(scene.samples_per_pixel, 33);
  EXPECT_EQ(scene.film.crop_x, 5);
  EXPECT_EQ(scene.film.crop_width, 10);
  EXPECT_EQ(scene.film.crop_height, 20);
  EXPECT_EQ(scene.film.format, PixelFormat::kRgba);
  EXPECT_EQ(scene.film.filter, FilterKind::kMitchell);
  EXPECT_EQ(scene.film.mitchell_b, 0.5F);
  EXPECT_NEAR(scene.camera.half_width, 2, 1e-6);
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("Owen-scrambled")));
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("no emitter")));
}

TEST(SceneReaderTest, ReadsLights) {
  const Scene scene = Parse(SceneText(R"(
  <emitter type="point"><point name="position" x="1" y="2" z="3"/>
    <rgb name="intensity" value="1, 2, 3"/></emitter>
  <emitter type="spot"><float name="cutoffAngle" value="40"/>
    <transform name="toWorld"><lookat origin="0,0,4" target="0,0,0"/></transform></emitter>
  <emitter type="directional"><vector name="direction" x="0" y="-2" z="0"/>
    <spectrum name="irradiance" value="5"/></emitter>
  <emitter type="constant"><srgb name="radiance" value="#ff8000"/></emitter>
  <shape type="rectangle"><emitter type="area"><rgb name="radiance" value="4"/></emitter>
  </shape>)"));
  ASSERT_EQ(scene.lights.size(), 4u);
  EXPECT_EQ(std::get<PointLight>(scene.lights[0].source).intensity, (Color{1, 2, 3}));
  const auto& spot = std::get<SpotLight>(scene.lights[1].source);
  EXPECT_EQ(spot.direction, (Vec3{0, 0, -1}));
  EXPECT_NEAR(spot.beam_rad, 0.75F * spot.cutoff_rad, 1e-6);
  EXPECT_EQ(std::get<DirectionalLight>(scene.lights[2].source).direction,
            (Vec3{0, -1, 0}));
  const Color radiance = std::get<ConstantLight>(scene.lights[3].source).radiance;
  EXPECT_NEAR(radiance.x, 1, 1e-6);
  EXPECT_NEAR(radiance.y, 0.2158605F, 1e-5);  // sRGB 128 [IEC 61966-2-1]
  EXPECT_EQ(*scene.shapes[0].radiance, (Color{4, 4, 4}));
  EXPECT_EQ(scene.shapes[0].bsdf, nullptr);
}

TEST(SceneReaderTest, BsdfsAndTexturesAreSharedById) {
  const Scene scene = Parse(SceneText(R"(
  <texture type="checkerboard" id="board"><rgb name="color0" value="0.5"/></texture>
  <bsdf type="diffuse" id="floor"><ref name="reflectance" id="board"/></bsdf>
  <shape type="rectangle"><ref id="floor"/></shape>
  <shape type="cube"><ref id="floor"/></shape>)"));
  EXPECT_NE(scene.shapes[0].bsdf, nullptr);
  EXPECT_EQ(scene.shapes[0].bsdf, scene.shapes[1].bsdf);
  EXPECT_THAT(ReaderError(SceneText(R"(<shape type="cube"><ref id="flor"/></shape>)")),
              HasSubstr("no bsdf with id 'flor' above this line; none is known here"));
}

TEST(SceneReaderTest, EveryBsdfHasItsDefaults) {
  for (const char* type : {"diffuse",
                           "plastic",
                           "roughplastic",
                           "conductor",
                           "roughconductor",
                           "dielectric"}) {
    const Scene scene = Parse(SceneText(
        std::string("<shape type=\"sphere\"><bsdf type=\"") + type + "\"/></shape>"));
    EXPECT_NE(scene.shapes[0].bsdf, nullptr) << type;
  }
  EXPECT_NE(Parse(SceneText("<shape type=\"sphere\"/>")).shapes[0].bsdf, nullptr);
}

TEST(SceneReaderTest, AMirroredMeshKeepsItsOutside) {
  const Scene scene = Parse(SceneText(R"(<shape type="cube">
  <transform name="toWorld"><scale x="-1"/></transform></shape>
  <shape type="rectangle"><boolean name="flipNormals" value="true"/></shape>)"));
  const auto& cube = std::get<TriangleMesh>(scene.shapes[0].geometry);
  for (const auto& t : cube.triangles) {
    const Vec3 p = cube.positions[t[0]];
    const Vec3 face = Cross(cube.positions[t[1]] - p, cube.positions[t[2]] - p);
    EXPECT_GT(Dot(face, p), 0);
    EXPECT_GT(Dot(cube.normals[t[0]], p), 0);
  }
  const auto& rectangle = std::get<TriangleMesh>(scene.shapes[1].geometry);
  EXPECT_EQ(rectangle.normals[0], (Vec3{0, 0, -1}));
}

TEST(SceneReaderTest, ReadsTextureFilesAsLinear) {
  const nacre::testing::TempFolder folder;
  PngImage png{1, 2, 3, 8, {255, 0, 128, 0, 255, 0}};
  WritePng(folder / "t.png", png);
  ExrPart exr{"", 1, 1, {"R", "G", "B"}, {0.25F, 0.5F, 0.75F}, {}};
  WriteExr(folder / "t.exr", {exr});
  const auto color_at = [&](const std::string& parameters, Vec2 uv) {
    const Scene scene =
        ParseScene(SceneText("<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture "
                             "name=\"reflectance\" type=\"bitmap\">" +
                             parameters + "</texture></bsdf></shape>"),
                   "s.xml",
                   folder.path());
    return scene.shapes[0].bsdf->Evaluate({0, 0, 1}, {0, 0, 1}, uv).value * 3.14159265F;
  };
  const std::string name = "<string name=\"filename\" value=\"t.png\"/>";
  EXPECT_NEAR(color_at(name, {0.5F, 0.75F}).z, 0.2158605F, 1e-5);
  EXPECT_NEAR(color_at(name, {0.5F, 0.25F}).y, 1, 1e-5);
  EXPECT_NEAR(color_at(name + "<float name=\"gamma\" value=\"1\"/>", {0.5F, 0.75F}).z,
              128 / 255.0,
              1e-5);
  EXPECT_NEAR(
      color_at("<string name=\"filename\" value=\"t.exr\"/>", {0, 0}).y, 0.5, 1e-5);
}

TEST(SceneReaderTest, DipoleCoefficientsInAllThreeWays) {
  const auto eta = [](const std::string& parameters) {
    const Scene scene =
        Parse(SceneText("<shape type=\"sphere\"><subsurface type=\"dipole\">" +
                        parameters + "</subsurface></shape>"));
    return scene.shapes[0].translucency->model->Eta();
  };
  EXPECT_EQ(eta("<string name=\"material\" value=\"Marble\"/>"), 1.5F);
  EXPECT_EQ(eta("<string name=\"material\" value=\"skin1\"/>"), 1.3F);
  EXPECT_EQ(eta("<rgb name=\"sigmaS\" value=\"2\"/><rgb name=\"sigmaA\" value=\"0.1\"/>"
                "<float name=\"intIOR\" value=\"1.4\"/>"),
            1.4F);
  EXPECT_EQ(eta("<rgb name=\"sigmaT\" value=\"2\"/><rgb name=\"albedo\" value=\"0.9\"/>"
                "<float name=\"g\" value=\"0.5\"/>"),
            1.5F);
}

TEST(PresetTest, IsLookedForWhereTheManualSays) {
  const nacre::testing::TempFolder folder;
  std::filesystem::create_directories(folder / "presets");
  std::ofstream(folder / "here.nacre.exr") << "x";
  std::ofstream(folder / "presets/there.nacre.exr") << "x";
  EXPECT_EQ(FindPreset("here", folder.path()), folder / "here.nacre.exr");
  EXPECT_EQ(FindPreset("here.nacre.exr", folder.path()), folder / "here.nacre.exr");
  setenv("NACRE_PRESET_PATH", ("/nowhere:" + (folder / "presets").string()).c_str(), 1);
  EXPECT_EQ(FindPreset("there", folder.path()), folder / "presets/there.nacre.exr");
  try {
    FindPreset("missing", folder.path());
    ADD_FAILURE() << "found what isn't there";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), HasSubstr("no material 'missing'"));
    EXPECT_THAT(e.what(), HasSubstr(folder.path().string()));
    EXPECT_THAT(e.what(), HasSubstr("/nowhere"));
    EXPECT_THAT(e.what(), HasSubstr("set NACRE_PRESET_PATH"));
  }
  unsetenv("NACRE_PRESET_PATH");
}

}  // namespace
}  // namespace nacre::render::testing

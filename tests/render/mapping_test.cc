// Where a measured sample lies on a surface, and that it doesn't show how that was
// decided: neither seams, stretch of texture coordinates, nor the size of triangles.

#include "render/subsurface/models.h"
#include "tests/render/bias.h"
#include "tests/render/mesh_subdivision.h"
#include "tests/render/scene_text.h"
#include "tests/render/subsurface/handmade_material.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <fstream>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;

// A sample of 10 × 10 mm; `pattern`: brighter and darker along x, once.
std::shared_ptr<const factor::Material> Sample(double pattern) {
  const DipoleProfile profile(0.05, 2, 0.6);
  factor::Material m = *DipoleMaterial({profile, profile, profile},
                                       {.points = 20, .core = 15, .pitch_mm = 0.5});
  for (std::size_t n = 0; n < m.f.size(); ++n) {
    const double x = (static_cast<double>(n % 20) + 0.5) / 20;
    m.f[n] = static_cast<float>((1 + pattern * std::sin(2 * std::numbers::pi * x)) /
                                (1 + pattern));
  }
  SetAlbedo(m);
  return std::make_shared<const factor::Material>(std::move(m));
}

// A slab or cube, 5 mm a unit, lit by a spot beside its middle.
Scene Lit(const std::string& shape,
          const std::shared_ptr<const factor::Material>& material,
          Mapping mapping,
          const std::string& origin = "0, 0, 5") {
  Scene scene = Parse(SceneText(
      R"(<emitter type="spot"><float name="cutoffAngle" value="9"/>
         <float name="beamWidth" value="4"/><rgb name="intensity" value="90"/>
         <transform name="toWorld"><lookat origin="0, 0, 4" target="-0.2, 0, 0"
           up="0, 1, 0"/></transform></emitter>)" +
          shape + R"(<subsurface type="dipole"><string name="material" value="marble"/>
         <float name="scale" value="5"/>
         <boolean name="irrIndirect" value="false"/></subsurface></shape>)",
      origin,
      "0, 0, 0",
      24));
  scene.shapes[0].translucency->model = MakeFactored(material, {}, {mapping, {}});
  return scene;
}

ExrPart Picture(const Scene& scene, std::uint64_t seed = 1) {
  RenderOptions options;
  options.spp = 16;
  options.seed = seed;
  options.points_per_patch = 32;
  return Render(scene, options).image;
}

// n × n squares, whose uv are `uv_of` of place and half (0: x < 0).
template <class UvOf>
TriangleMesh Slab(int n, const UvOf& uv_of) {
  TriangleMesh mesh;
  for (int half = 0; half < 2; ++half) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const int columns = n / 2;
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= columns; ++i) {
        const float x =
            static_cast<float>(2 * (i + half * columns)) / static_cast<float>(n) - 1;
        const float y = static_cast<float>(2 * j) / static_cast<float>(n) - 1;
        mesh.positions.push_back({x, y, 0});
        mesh.uvs.push_back(uv_of(x, y, half));
        if (i < columns && j < n) {
          const auto a = first + static_cast<std::uint32_t>(j * (columns + 1) + i);
          const auto up = a + static_cast<std::uint32_t>(columns + 1);
          mesh.triangles.push_back({a, a + 1, up + 1});
          mesh.triangles.push_back({a, up + 1, up});
        }
      }
    }
  }
  return mesh;
}

Vec2 Plain(float x, float y, int /*half*/) {
  return {0.5F * (x + 1), 0.5F * (y + 1)};
}

// As Plain, but the right half is another chart: three repeats on.
Vec2 Shifted(float x, float y, int half) {
  const Vec2 uv = Plain(x, y, half);
  return half == 0 ? uv : Vec2{uv.x + 3, uv.y - 2};
}

// The right half turned by a right angle, for materials that are the same all over.
Vec2 Turned(float x, float y, int half) {
  const Vec2 uv = Plain(x, y, half);
  return half == 0 ? uv : Vec2{uv.y, 1 - uv.x};
}

// Up to 1.8 times as wide as long, and sheared.
Vec2 Stretched(float x, float y, int half) {
  const Vec2 uv = Plain(x, y, half);
  return {uv.x + 0.2F * uv.x * uv.x + 0.2F * uv.y, 0.6F * uv.y + 0.1F * uv.y * uv.y};
}

template <class UvOf>
Scene SlabScene(const UvOf& uv_of, double pattern, Mapping mapping) {
  Scene scene = Lit("<shape type=\"rectangle\">", Sample(pattern), mapping);
  scene.shapes[0].geometry = Slab(16, uv_of);
  return scene;
}

// The largest difference next to the seam, of what is there.
double AcrossSeam(const ExrPart& a, const ExrPart& b) {
  double worst = 0;
  const auto red_a = a.Channel(0);
  const auto red_b = b.Channel(0);
  for (std::size_t y = 6; y < 18; ++y) {
    for (std::size_t x = 10; x < 14; ++x) {
      const auto expected = static_cast<double>(red_b[y * 24 + x]);
      worst = std::max(
          worst,
          std::abs(static_cast<double>(red_a[y * 24 + x]) - expected) / expected);
    }
  }
  return worst;
}

TEST(MappingTest, ASeamDoesNotShowInTheWorld) {
  const ExrPart whole = Picture(SlabScene(Plain, 0.3, Mapping::kWorld));
  const ExrPart cut = Picture(SlabScene(Shifted, 0.3, Mapping::kWorld));
  EXPECT_LT(AcrossSeam(cut, whole), 0.002);
  // Where texture coordinates say how far it is, it does: the test sees a seam.
  EXPECT_GT(AcrossSeam(Picture(SlabScene(Shifted, 0.3, Mapping::kTexture)), whole),
            0.1);
  const ExrPart even = Picture(SlabScene(Plain, 0, Mapping::kWorld));
  const ExrPart turned = Picture(SlabScene(Turned, 0, Mapping::kWorld));
  EXPECT_LT(AcrossSeam(turned, even), 0.002);
}

TEST(MappingTest, StretchOfTheParameterisationDoesNotShow) {
  const ExrPart world = Picture(SlabScene(Plain, 0, Mapping::kWorld));
  const ExrPart plain = Picture(SlabScene(Plain, 0, Mapping::kTexture));
  const ExrPart stretched = Picture(SlabScene(Stretched, 0, Mapping::kTexture));
  EXPECT_LT(Compare(plain, plain, world, world).total, 0.01);
  EXPECT_LT(Compare(stretched, stretched, world, world).total, 0.01);
}

Scene TurnedCube(Mapping mapping) {
  return Lit(
      "<shape type=\"cube\"><transform name=\"toWorld\"><rotate y=\"1\" "
      "angle=\"30\"/></transform>",
      Sample(0.3),
      mapping,
      "2, 3, 5");
}

TEST(MappingTest, FastIsReferenceForEachMapping) {
  for (const Mapping mapping :
       {Mapping::kTexture, Mapping::kWorld, Mapping::kTriplanar}) {
    Scene scene = TurnedCube(mapping);
    if (mapping == Mapping::kTexture) {
      scene.shapes[0].geometry = Slab(16, Stretched);
    }
    const auto picture = [&](const char* integrator, int spp, std::uint64_t seed) {
      RenderOptions options;
      options.integrator = integrator;
      options.spp = spp;
      options.seed = seed;
      return Render(scene, options).image;
    };
    const Difference d = Compare(picture("fast", 64, 1),
                                 picture("fast", 64, 2),
                                 picture("reference", 256, 3),
                                 picture("reference", 256, 4));
    EXPECT_LT(d.bias, 0.02) << static_cast<int>(mapping) << " at most " << d.bound;
    EXPECT_LT(d.noise, 0.05);
  }
}

TEST(MappingTest, ProjectionsDoNotShowTheTriangles) {
  for (const Mapping mapping : {Mapping::kBox, Mapping::kTriplanar}) {
    Scene scene = TurnedCube(mapping);
    auto& mesh = std::get<TriangleMesh>(scene.shapes[0].geometry);
    mesh.uvs.clear();
    const ExrPart coarse = Picture(scene);
    mesh = Subdivided(Subdivided(mesh));
    const ExrPart fine = Picture(scene);
    EXPECT_LT(Compare(fine, fine, coarse, coarse).total, 0.005);
  }
}

TEST(MappingTest, ABoxShowsTheSampleUprightOnEachSide) {
  const MaterialMapping box(Mapping::kBox, {}, 10, 20);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0F, 1.0F}) {
      SurfacePoint p;
      p.normal = {axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0};
      const SamplePlaces there = box.Places(p);
      ASSERT_EQ(there.count, 1u);
      const SamplePlace& at = there.place[0];
      // Not mirrored: seen from outside, u × v points to the eye.
      EXPECT_NEAR(Dot(Cross(at.tangent_u, at.tangent_v), p.normal), 1, 1e-6F);
      EXPECT_EQ(at.tangent_v.y, axis == 1 ? 0 : 1);
      EXPECT_EQ(at.uv.x, 0.5F);
      // A millimetre to the right and up is a tenth and a twentieth on.
      p.position_mm = at.tangent_u + at.tangent_v;
      EXPECT_NEAR(box.Places(p).place[0].uv.x, 0.6F, 1e-6F);
      EXPECT_NEAR(box.Places(p).place[0].uv.y, 0.55F, 1e-6F);
    }
  }
}

TEST(MappingTest, TriplanarSharesOutByTheNormal) {
  const MaterialMapping three(Mapping::kTriplanar, {}, 10, 10);
  SurfacePoint p;
  p.normal = Normalized({1, -2, 1.5F});
  const SamplePlaces there = three.Places(p);
  ASSERT_EQ(there.count, 3u);
  const float sum = 1 + 16 + 5.0625F;
  EXPECT_NEAR(there.place[0].weight, 16 / sum, 1e-5F);
  EXPECT_NEAR(there.place[1].weight, 5.0625F / sum, 1e-5F);
  EXPECT_NEAR(there.place[2].weight, 1 / sum, 1e-5F);
  for (const SamplePlace& place : there) {
    EXPECT_NEAR(Dot(place.tangent_u, p.normal), 0, 1e-6F);
  }
  p.normal = {0, 0, -1};
  EXPECT_EQ(three.Places(p).count, 1u);
}

// What is said to a material on a shape.
class MappingText : public ::testing::Test {
 protected:
  MappingText() {
    factor::WriteMaterial(folder_.path() / "sample.nacre.exr", *Sample(0.2));
  }
  std::string Subsurface(const std::string& rest) const {
    return "<subsurface type=\"svd\"><string name=\"material\" value=\"" +
           (folder_.path() / "sample.nacre.exr").string() + "\"/>" + rest +
           "</subsurface></shape><emitter type=\"constant\"/>";
  }
  static std::string Notes(const std::string& body) {
    std::string all;
    for (const std::string& note : Parse(SceneText(body)).notes) {
      all += note + "\n";
    }
    return all;
  }
  nacre::testing::TempFolder folder_;
};

TEST_F(MappingText, ErrorsNameLineAndWord) {
  const auto error = [&](const std::string& rest) {
    return ReaderError(SceneText("<shape type=\"sphere\">\n" + Subsurface(rest)));
  };
  EXPECT_THAT(error("<string name=\"mapping\" value=\"worlds\"/>"),
              AllOf(HasSubstr("test.xml:"), HasSubstr("did you mean 'world'?")));
  EXPECT_THAT(error("<transform name=\"toWorld\"><scale value=\"2\"/></transform>"),
              HasSubstr("only be moved and turned"));
  {
    std::ofstream bare(folder_.path() / "bare.obj");
    bare << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  }
  const std::string mesh = "<shape type=\"obj\"><string name=\"filename\" value=\"" +
                           (folder_.path() / "bare.obj").string() + "\"/>";
  EXPECT_THAT(ReaderError(SceneText(
                  mesh + Subsurface("<string name=\"mapping\" value=\"texture\"/>"))),
              HasSubstr("no texture coordinates"));
  EXPECT_THAT(Notes(mesh + Subsurface("")), HasSubstr("mapping triplanar"));
}

TEST_F(MappingText, SizesThatCannotBeMeantAreNoted) {
  const auto notes = [&](const std::string& scale) {
    return Notes("<shape type=\"sphere\">" +
                 Subsurface("<float name=\"scale\" value=\"" + scale + "\"/>"));
  };
  // The sample is 10 × 10 mm, its core 7.5 mm; the sphere's area 4π units.
  EXPECT_EQ(notes("3"), "");
  EXPECT_THAT(notes("1"), HasSubstr("the shape is only 3.464 mm across"));
  EXPECT_THAT(notes("100"), HasSubstr("35.4 times as large"));
  EXPECT_THAT(notes("100"), HasSubstr("less than a pixel"));
}

}  // namespace
}  // namespace nacre::render::testing

// Scenes that break naive arithmetic, and what is checked at the end of every picture.

#include "core/fresnel.h"
#include "factor/material.h"
#include "render/render.h"
#include "render/subsurface/dipole_profile.h"
#include "render/subsurface/models.h"
#include "tests/render/scene_text.h"
#include "tests/render/subsurface/handmade_material.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fstream>

namespace nacre::render::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const char* const kSky =
    R"(<emitter type="constant"><rgb name="radiance" value="1"/></emitter>)";

// Seen in what comes out of the material alone.
const char* const kLamp =
    R"(<emitter type="point"><point name="position" x="3" y="4" z="5"/>
      <rgb name="intensity" value="20"/></emitter>)";

// Rounding moves numbers of the scene by u each, on whose way to a pixel are 16 of
// them, or 256 where they are places; and one node of patches may be gathered as one
// source or not, which changes what is gathered by DipoleOptions::negligible at most.
constexpr double kU = 0x1p-24;
const double kOneNode = DipoleOptions().negligible;

RenderOptions Few(int spp = 4) {
  RenderOptions options;
  options.spp = spp;
  options.thread_count = 1;
  options.sampling = "even";
  options.lazy = false;  // looking for what is seen takes longer than these pictures
  return options;
}

Rendering Picture(const std::string& body, const std::string& origin = "0, 0, 5") {
  return Render(Parse(SceneText(body, origin)), Few());
}

std::string Number(double value) {
  return fmt::format("{}", value);  // to the last bit
}

void ExpectClean(const Rendering& r, const std::string& what) {
  EXPECT_EQ(r.summary.bad_samples, 0) << what;
  EXPECT_EQ(r.summary.invariants.not_finite, 0) << what;
  EXPECT_EQ(r.summary.invariants.negative, 0) << what;
}

// a is `scale` times b within `bound` of the brightest pixel of b.
void ExpectScaled(const ExrPart& a,
                  const ExrPart& b,
                  double scale,
                  double bound,
                  const std::string& what) {
  ASSERT_EQ(a.values.size(), b.values.size());
  const double most =
      static_cast<double>(*std::max_element(b.values.begin(), b.values.end()));
  ASSERT_GT(most, 0) << what;
  for (std::size_t n = 0; n < a.values.size(); ++n) {
    ASSERT_NEAR(static_cast<double>(a.values[n]) / scale,
                static_cast<double>(b.values[n]),
                bound * most)
        << what << " " << n;
  }
}

// A factored material of 2 × 2 points times `scale`, in a file.
class RenderStress : public ::testing::Test {
 protected:
  std::string Svd(double scale, int points = 2, int core = 5) {
    factor::Material m = OneTermMaterial({points, core, 0.2}, 3);
    for (std::size_t n = 0; n < m.h.size(); ++n) {
      const double r = std::hypot(static_cast<double>(n % 5) - 2, 1);
      m.h[n] = static_cast<float>(scale / (1 + r));
    }
    SetAlbedo(m);
    const std::string path = (folder_.path() / "m.nacre.exr").string();
    factor::WriteMaterial(path, m);
    return "<subsurface type=\"svd\"><string name=\"material\" value=\"" + path +
           "\"/><string name=\"mapping\" value=\"triplanar\"/></subsurface>";
  }
  nacre::testing::TempFolder folder_;
};

std::string Ball(const std::string& matter, double radius = 1) {
  return "<shape type=\"sphere\"><float name=\"radius\" value=\"" + Number(radius) +
         "\"/>" + matter + "</shape>";
}

std::string Dipole(double sigma_a, double sigma_s, double eta, double mm_per_unit = 1) {
  return fmt::format(
      R"(<subsurface type="dipole"><rgb name="sigmaA" value="{0:e}"/>
        <rgb name="sigmaS" value="{1:e}"/><float name="intIOR" value="{2}"/>
        <float name="scale" value="{3:e}"/></subsurface>)",
      sigma_a,
      sigma_s,
      eta,
      mm_per_unit);
}

// 12 decades of the unit that a scene is measured in.
TEST_F(RenderStress, SizesFromAMillionthToAMillionLookAlike) {
  const auto picture = [&](const char* shape, double size) {
    const std::string text = fmt::format(
        R"(<shape type="{}"><transform name="toWorld"><scale value="{:e}"/></transform>{}
           </shape>)",
        shape,
        size,
        Dipole(0.02, 3, 1.5, 1 / size));
    std::string scene =
        SceneText(text + kSky, "0, " + Number(4 * size) + ", " + Number(5 * size));
    scene.replace(scene.find("<float name=\"fov\""),
                  0,
                  "<float name=\"nearClip\" value=\"" + Number(0.01 * size) +
                      "\"/><float name=\"farClip\" value=\"" + Number(100 * size) +
                      "\"/>");
    return Render(Parse(scene), Few());
  };
  for (const char* shape : {"sphere", "cube"}) {
    const Rendering plain = picture(shape, 1);
    ExpectClean(plain, shape);
    for (const double size : {1e-6, 1e-3, 1e3, 1e6}) {
      const Rendering scaled = picture(shape, size);
      ExpectClean(scaled, shape);
      ExpectScaled(
          scaled.image, plain.image, 1, kOneNode + 256 * kU, shape + Number(size));
    }
    for (const int exponent : {-20, -10, 1, 10, 20}) {  // which rounds nothing
      const double size = std::ldexp(1, exponent);
      ExpectScaled(picture(shape, size).image, plain.image, 1, 0, shape + Number(size));
    }
  }
}

TEST_F(RenderStress, PicturesAreLinearInTheLight) {
  const std::string ball =
      Ball(Dipole(0.02, 3, 1.5)) +
      "<shape type=\"rectangle\"><transform name=\"toWorld\"><scale "
      "value=\"4\"/><translate z=\"-2\"/></transform></shape>";
  const auto picture = [&](double power) {
    return Picture(
        ball +
            R"(<emitter type="point"><point name="position" x="3" y="4" z="5"/>
      <rgb name="intensity" value=")" +
            Number(power) + "\"/></emitter>",
        "0, 0, 9");
  };
  const Rendering one = picture(1);
  for (const double power : {1e-30, 1e-12, 1e12, 1e30}) {
    const Rendering scaled = picture(power);
    ExpectClean(scaled, Number(power));
    // Roundings of one light's flux, u each, on the way to a pixel, and that one node
    // of patches is or isn't gathered as one source: DipoleOptions::negligible.
    ExpectScaled(scaled.image, one.image, power, 2e-4 + 0x1p-20, Number(power));
  }
  for (const int exponent : {-100, -60, -1, 1, 60, 100}) {  // which rounds nothing
    const double power = std::ldexp(1, exponent);
    ExpectScaled(picture(power).image, one.image, power, 0, Number(power));
  }
  const Rendering dark = picture(0);
  ExpectClean(dark, "dark");
  EXPECT_THAT(dark.image.values, ::testing::Each(0.0F));
}

TEST_F(RenderStress, MoreLightThanAFloatHoldsIsSaid) {
  const Rendering r =
      Picture(Ball("") +
              R"(<emitter type="point"><point name="position" x="0" y="0" z="1.2"/>
      <rgb name="intensity" value="3e38"/></emitter>)");
  EXPECT_GT(r.summary.bad_samples + r.summary.invariants.not_finite, 0);
  if (r.summary.invariants.not_finite > 0) {
    EXPECT_THAT(r.summary.invariants.Warnings(), Contains(HasSubstr("aren't finite")));
  } else {
    EXPECT_THAT(r.summary.Brief(), HasSubstr("weren't finite"));
  }
}

// And more light out than in is said, not cut.
TEST_F(RenderStress, MaterialsOfAnyScaleAreLinear) {
  const Rendering one = Picture(Ball(Svd(0.1)) + kLamp);
  ExpectClean(one, "one");
  EXPECT_THAT(one.summary.invariants.Warnings(), IsEmpty());
  for (const double scale : {1e-30, 1e-12, 1e12, 1e30}) {
    const Rendering scaled = Picture(Ball(Svd(0.1 * scale)) + kLamp);
    ExpectClean(scaled, Number(scale));
    // Within a cell R_d goes on like the profile of a medium of that albedo: not
    // linear.
    ExpectScaled(scaled.image, one.image, scale, 1e-2, Number(scale));
    EXPECT_EQ(scaled.summary.invariants.Warnings().size(), scale > 1 ? 3U : 0U);
  }
  const Rendering none = Picture(Ball(Svd(0)) + kLamp);
  ExpectClean(none, "zero");
}

TEST_F(RenderStress, OnePointOfOneCell) {
  const Rendering r = Picture(Ball(Svd(0.1, 1, 1)) + kSky);
  ExpectClean(r, "one point");
  EXPECT_GT(r.summary.invariants.EnergyRatio(), 0);
}

TEST_F(RenderStress, ExtremesOfMedia) {
  struct Case {
    double sigma_a, sigma_s, eta, mm_per_unit = 1;
  };
  for (const Case& c : {Case{0, 3, 1.5},   // albedo 1
                        Case{0.02, 3, 1},  // no interface
                        Case{1e-12, 3, 1.5},
                        Case{1e-6, 1e6, 1.5, 1e-3},  // 12 decades
                        Case{1e6, 1e-6, 1.5, 1e-3},
                        Case{0.02, 3, 3}}) {
    const std::string what = fmt::format("{} {} {}", c.sigma_a, c.sigma_s, c.eta);
    RenderOptions options = Few();
    options.max_lit_points = 20000;
    const Rendering r = Render(
        Parse(
            SceneText(Ball(Dipole(c.sigma_a, c.sigma_s, c.eta, c.mm_per_unit)) + kSky)),
        options);
    ExpectClean(r, what);
    EXPECT_LE(r.summary.invariants.EnergyRatio(), 1.05) << what;
  }
  EXPECT_THAT(ReaderError(SceneText(Ball(Dipole(3, 0, 1.5)))),
              HasSubstr("scatters in no channel"));
}

// What the check at the end measures, against the integral of the profile.
TEST_F(RenderStress, EnergyOfALargeBallIsThatOfTheProfile) {
  // Millimetres of radius: many mean free paths, few patches.
  for (const auto& [sigma_a, radius_mm] :
       {std::pair{0.002, 20.0}, {0.05, 10.0}, {1.0, 3.0}}) {
    RenderOptions options = Few();
    const Rendering r = Render(
        Parse(SceneText(Ball(Dipole(sigma_a, 3, 1.5, radius_mm)) + kSky)), options);
    const DipoleProfile profile(sigma_a, 3, DiffuseFresnelReflectance(1 / 1.5));
    EXPECT_NEAR(r.summary.invariants.EnergyRatio() / profile.Total(), 1, 0.05)
        << sigma_a;
    EXPECT_THAT(r.summary.invariants.Warnings(), IsEmpty());
  }
}

TEST_F(RenderStress, DegenerateTrianglesAreAsIfNotThere) {
  const auto picture = [&](const std::string& more) {
    const std::string path = (folder_.path() / "mesh.obj").string();
    std::ofstream(path) << "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 0 0\n"
                           "v 1e-30 0 0\nf 1 2 3\nf 1 3 4\n"
                        << more;
    return Picture("<shape type=\"obj\"><string name=\"filename\" value=\"" + path +
                   "\"/>" + Dipole(0.02, 3, 1.5) + "</shape>" + kSky);
  };
  const Rendering plain = picture("");
  ExpectClean(plain, "plain");
  // A point thrice, a line, a line of no length, a needle.
  const Rendering more = picture("f 5 5 5\nf 1 5 3\nf 5 6 5\nf 1 2 6\n");
  ExpectClean(more, "degenerate");
}

}  // namespace
}  // namespace nacre::render::testing

// Analytic models of translucency with textures for parameters.

#include "core/fresnel.h"
#include "tests/render/bias.h"
#include "tests/render/scene_text.h"

#include <gmock/gmock.h>

namespace nacre::render::testing {
namespace {

using ::testing::HasSubstr;

// A slab of 20 × 20 mm in a light that falls at an angle; `spot`: a small one.
std::string Slab(const std::string& subsurface, bool spot, int size = 16) {
  const std::string light =
      spot
          ? R"(<emitter type="spot"><float name="cutoffAngle" value="9"/>
         <float name="beamWidth" value="4"/><rgb name="intensity" value="90"/>
         <transform name="toWorld"><lookat origin="0, 0, 4" target="-0.2, 0, 0"
           up="0, 1, 0"/></transform></emitter>)"
          : R"(<emitter type="directional"><vector name="direction" x="1" y="0" z="-1"/>
         <rgb name="irradiance" value="2"/></emitter>)";
  return SceneText(light + R"(<shape type="rectangle"><transform name="toWorld">
        <scale value="2"/></transform>)" +
                       subsurface + "</shape>",
                   "0, 0, 5",
                   "0, 0, 0",
                   size);
}

std::string Model(const std::string& type, const std::string& rest) {
  return "<subsurface type=\"" + type +
         "\"><float name=\"scale\" value=\"5\"/><boolean name=\"irrIndirect\" "
         "value=\"false\"/>" +
         rest + "</subsurface>";
}

// Two colours in squares; the border lies in the middle of the picture.
std::string Checks(const std::string& name,
                   const std::string& a,
                   const std::string& b) {
  return "<texture type=\"checkerboard\" name=\"" + name +
         "\"><rgb name=\"color0\" value=\"" + a + "\"/><rgb name=\"color1\" value=\"" +
         b + "\"/></texture>";
}

ExrPart Picture(const std::string& xml,
                const char* integrator = "fast",
                int spp = 64,
                std::uint64_t seed = 1,
                double closer = 1) {
  RenderOptions options;
  options.exitance_spacing /= closer;
  options.integrator = integrator;
  options.spp = spp;
  options.seed = seed;
  return Render(Parse(xml), options).image;
}

TEST(TexturedMediaTest, ATextureOfOneColourIsThatColour) {
  const std::string scattering = R"(<rgb name="sigmaS" value="1, 2, 3"/>)";
  const std::string absorption = "0.05, 0.02, 0.01";
  for (const char* type : {"dipole", "betterdipole"}) {
    const ExrPart plain = Picture(Slab(
        Model(type, scattering + "<rgb name=\"sigmaA\" value=\"" + absorption + "\"/>"),
        true));
    const ExrPart textured = Picture(
        Slab(Model(type, scattering + Checks("sigmaA", absorption, absorption)), true));
    EXPECT_LT(Compare(textured, textured, plain, plain).total, 0.01) << type;
  }
  const std::string length = R"(<rgb name="meanFreePath" value="1, 0.6, 0.4"/>)";
  const std::string albedo = "0.9, 0.6, 0.3";
  const ExrPart plain = Picture(
      Slab(Model("normalizeddiffusion",
                 length + "<rgb name=\"reflectance\" value=\"" + albedo + "\"/>"),
           true));
  const ExrPart textured = Picture(
      Slab(Model("normalizeddiffusion", length + Checks("reflectance", albedo, albedo)),
           true));
  EXPECT_LT(Compare(textured, textured, plain, plain).total, 0.01);
}

// Under even light, what leaves is what the albedo there says, sharply.
TEST(TexturedMediaTest, EvenLightShowsTheTexture) {
  const std::string body =
      Model("normalizeddiffusion",
            R"(<rgb name="meanFreePath" value="0.5, 0.5, 0.5"/>)" +
                Checks("reflectance", "0.8, 0.4, 0.2", "0.4, 0.8, 0.6"));
  const ExrPart image = Picture(Slab(body, false, 8));
  const double entering =
      2 * std::sqrt(0.5) * FresnelTransmittance(std::sqrt(0.5), 1.5);
  for (std::size_t i = 0; i < 64; ++i) {
    const bool first = (i % 8 < 4) == (i / 8 < 4);
    for (std::size_t c = 0; c < 3; ++c) {
      const double albedo =
          first ? std::array{0.4, 0.8, 0.6}[c] : std::array{0.8, 0.4, 0.2}[c];
      const double other =
          first ? std::array{0.8, 0.4, 0.2}[c] : std::array{0.4, 0.8, 0.6}[c];
      // Straight above, F_t is that of the normal within 1e-3.
      const double unit = entering * FresnelTransmittance(1.0, 1.5) /
                          (std::numbers::pi * ExitNormalization(1.5));
      const auto seen = static_cast<double>(image.Channel(c)[i]) / unit;
      EXPECT_LT(std::min(std::abs(seen - albedo), std::abs(seen - other)), 0.01 * seen)
          << i << ' ' << c;
    }
  }
}

TEST(TexturedMediaTest, FastIsReference) {
  for (const std::string& body :
       {Model("dipole",
              R"(<rgb name="sigmaS" value="2, 2, 2"/>)" +
                  Checks("sigmaA", "0.2, 0.05, 0.02", "0.01, 0.1, 0.3")),
        Model("normalizeddiffusion",
              Checks("meanFreePath", "0.8, 1.2, 2", "1.5, 0.8, 1") +
                  Checks("reflectance", "0.8, 0.4, 0.2", "0.4, 0.8, 0.6"))}) {
    const std::string xml = Slab(body, true, 8);
    const Difference d = Compare(Picture(xml, "fast", 64, 1, 4),
                                 Picture(xml, "fast", 64, 2, 4),
                                 Picture(xml, "reference", 1024, 3),
                                 Picture(xml, "reference", 1024, 4));
    EXPECT_LT(d.bias, 0.015) << "at most " << d.bound;
    EXPECT_LT(d.noise, 0.03);
  }
}

TEST(TexturedMediaTest, ZeroRadiusIsDiffuse) {
  // By the closed form, L = A E cos θ F_t(θ_i) F_t(θ_o) / (π c).
  const ExrPart image =
      Picture(Slab(Model("normalizeddiffusion",
                         R"(<rgb name="reflectance" value="0.8, 0.4, 0.2"/>
                    <rgb name="meanFreePath" value="0, 0, 0"/>)"),
                   false,
                   2));
  const double cosine = std::sqrt(0.5);
  const double expected = 2 * cosine * FresnelTransmittance(cosine, 1.5) *
                          FresnelTransmittance(1.0, 1.5) /
                          (std::numbers::pi * ExitNormalization(1.5));
  for (std::size_t c = 0; c < 3; ++c) {
    const double albedo = std::array{0.8, 0.4, 0.2}[c];
    EXPECT_NEAR(
        static_cast<double>(image.Channel(c)[0]), albedo * expected, 1e-3 * expected);
  }
}

// One channel spreads, one doesn't; half of the surface does, half doesn't.
TEST(TexturedMediaTest, PlacesAndChannelsWithoutRadiusAreDiffuse) {
  const std::string albedo = R"(<rgb name="reflectance" value="0.8, 0.8, 0.8"/>)";
  const auto model = [&](const std::string& length) {
    return Slab(Model("normalizeddiffusion", albedo + length), true);
  };
  const ExrPart none = Picture(model(R"(<rgb name="meanFreePath" value="0, 0, 0"/>)"));
  const ExrPart all = Picture(model(R"(<rgb name="meanFreePath" value="1, 1, 1"/>)"));
  const ExrPart red = Picture(model(R"(<rgb name="meanFreePath" value="1, 0, 0"/>)"));
  const ExrPart checks = Picture(model(Checks("meanFreePath", "1, 1, 1", "0, 0, 0")));
  const auto at =
      [](const ExrPart& image, std::size_t c, std::size_t x, std::size_t y) {
        return static_cast<double>(image.Channel(c)[y * 16 + x]);
      };
  for (const std::size_t x : {2u, 5u, 10u, 13u}) {
    for (const std::size_t y : {2u, 5u, 10u, 13u}) {
      EXPECT_NEAR(at(red, 0, x, y), at(all, 0, x, y), 0.02 * at(all, 0, x, y));
      EXPECT_NEAR(at(red, 1, x, y), at(none, 1, x, y), 0.01 * at(none, 1, x, y));
      const bool spreads = (x < 8) != (y < 8);
      const ExrPart& like = spreads ? all : none;
      EXPECT_NEAR(at(checks, 0, x, y), at(like, 0, x, y), 0.02 * at(like, 0, x, y))
          << x << ' ' << y;
    }
  }
}

TEST(TexturedMediaTest, ErrorsNameTheParameter) {
  const auto error = [](const std::string& type, const std::string& rest) {
    return ReaderError(Slab(Model(type, rest), false));
  };
  EXPECT_THAT(error("dipole",
                    Checks("sigmaA", "1, 1, 1", "2, 2, 2") +
                        R"(<rgb name="albedo" value="0.5"/>)"),
              HasSubstr("give one of"));
  EXPECT_THAT(error("dipole", Checks("sigmaA", "1, 1, 1", "2, 2, 2")),
              HasSubstr("scatters nowhere"));
  EXPECT_THAT(error("normalizeddiffusion", Checks("reflectance", "1, 1, 1", "2, 2, 2")),
              HasSubstr("above 1"));
  EXPECT_THAT(error("normalizeddiffusion", Checks("reflectence", "1, 1, 1", "1, 1, 1")),
              HasSubstr("did you mean 'reflectance'?"));
  EXPECT_THAT(error("dipole", R"(<string name="material" value="merlott"/>)"),
              HasSubstr("did you mean 'merlot'?"));
}

}  // namespace
}  // namespace nacre::render::testing

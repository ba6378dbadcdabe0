// nacre export --to a renderer: files, units, what is said of the fit.

#include "cli/exchange/burley.h"
#include "core/atomic_file.h"
#include "core/exr.h"
#include "tests/cli/command.h"
#include "tests/cli/exchange/burley_dataset.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fmt/format.h>
#include <regex>
#include <utility>

namespace nacre::exchange {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::RunJson;

constexpr double kAlbedo = 0.64;
constexpr double kLengthMm = 0.8;

class Export : public ::testing::Test {
 protected:
  void SetUp() override {
    reconstruct::WriteDataset(folder_ / "stone.rd.exr",
                              testing::BurleyDataset(2, 25, [](int, int, int) {
                                return std::pair(kAlbedo, kLengthMm);
                              }));
  }
  Json To(const std::string& target) {
    return RunJson({"export",
                    folder_ / "stone.rd.exr",
                    "--to",
                    target,
                    "--out",
                    folder_ / target});
  }
  std::string Text(const std::string& file) { return ReadFile(folder_ / file); }
  float Pixel(const std::string& file) {
    const std::vector<ExrPart> parts = ReadExr(folder_ / file);
    EXPECT_EQ(parts.size(), 1U) << "some programs show the first part only";
    EXPECT_EQ(parts[0].channels, (std::vector<std::string>{"R", "G", "B"}));
    return parts[0].values[0];
  }
  // The number after `words`.
  double Number(const std::string& file, const std::string& words) {
    const std::string text = Text(file);
    std::smatch found;
    const bool is_there =
        std::regex_search(text, found, std::regex(words + "([0-9.e-]+)"));
    EXPECT_TRUE(is_there) << words << " in\n" << text;
    return is_there ? std::stod(found[1]) : 0;
  }

  testing::TempFolder folder_;
  const double mean_free_path_mm_ = BurleyScaling(kAlbedo) * kLengthMm;
};

TEST_F(Export, CyclesGetsAlbedoAndLengthAndTheScript) {
  const Json json = To("cycles");
  EXPECT_NEAR(Pixel("cycles/albedo.exr"), kAlbedo, 0.005);
  EXPECT_NEAR(Pixel("cycles/radius.exr"), kLengthMm, 0.01);
  EXPECT_THAT(Text("cycles/nacre_material.py"), HasSubstr("def radius_factor"));
  EXPECT_NEAR(json.at("eta").get<double>(), 1.4, 1e-6);
  EXPECT_NEAR(json.at("size_mm")[0].get<double>(), 1.0, 1e-6);
  EXPECT_LT(json.at("fit").at("mean_residual").get<double>(), 6e-3);
  EXPECT_EQ(ParseJson(Text("cycles/export.json"), "export.json").at("source"),
            "stone.rd.exr");
}

TEST_F(Export, PbrtGetsMeanFreePaths) {
  To("pbrt-v4");
  EXPECT_NEAR(Pixel("pbrt-v4/reflectance.exr"), kAlbedo, 0.005);
  EXPECT_NEAR(Pixel("pbrt-v4/mfp.exr"), mean_free_path_mm_, 0.015);
  EXPECT_NEAR(Number("pbrt-v4/material.pbrt", "\"float eta\" "), 1.4, 1e-6);
}

TEST_F(Export, MaterialXHasRadiusTimesScale) {
  To("mtlx");
  const double radius_m =
      Number("mtlx/material.mtlx", "subsurface_radius\" type=\"float\" value=\"");
  const double scale = static_cast<double>(Pixel("mtlx/subsurface_radius_scale.exr"));
  EXPECT_LE(scale, 1.0);
  EXPECT_NEAR(1000 * radius_m * scale, mean_free_path_mm_, 0.015);
}

TEST_F(Export, RenderManAndAppleseed) {
  To("renderman");
  EXPECT_NEAR(Number("renderman/material.rib", "subsurfaceDmfp\" \\[") *
                  static_cast<double>(Pixel("renderman/subsurfaceDmfpColor.exr")),
              mean_free_path_mm_,
              0.015);
  To("appleseed");
  EXPECT_NEAR(Pixel("appleseed/mfp.exr"), mean_free_path_mm_, 0.015);
  EXPECT_THAT(Text("appleseed/material.appleseed"), HasSubstr("normalized_diffusion"));
}

TEST_F(Export, MitsubaGetsTheMeanAsAMedium) {
  const Json json = To("mitsuba3");
  EXPECT_NEAR(Number("mitsuba3/medium.xml", "sigma_t\" value=\""),
              1 / mean_free_path_mm_,
              0.02);
  EXPECT_NEAR(Number("mitsuba3/medium.xml", "\"albedo\" value=\""),
              SingleScatteringAlbedo(kAlbedo),
              0.005);
  EXPECT_THAT(json.at("lost").get<std::string>(), HasSubstr("texture"));
}

TEST_F(Export, EachStatesUnitResidualAndLoss) {
  for (const char* target : {"psf", "sss"}) {
    const Json json = To(target);
    EXPECT_THAT(json.at("unit").get<std::string>(), HasSubstr("R_d")) << target;
    EXPECT_LT(json.at("residual").get<double>(), 0.1) << target;
    EXPECT_THAT(json.at("lost").get<std::string>(), HasSubstr("pitch")) << target;
  }
  for (const char* target :
       {"cycles", "pbrt-v4", "mtlx", "renderman", "appleseed", "mitsuba3"}) {
    To(target);
    const Json json = ReadJson(folder_ / target / "export.json");
    EXPECT_THAT(json.at("units").get<std::string>(), HasSubstr("millimetres"));
    EXPECT_LT(json.at("fit").at("mean_residual").get<double>(), 0.02) << target;
    EXPECT_THAT(json.at("lost").get<std::string>(), HasSubstr("profile")) << target;
    const Json made = RunJson({"inspect", folder_ / target, "--provenance"});
    EXPECT_THAT(
        made.at("commands").get<std::vector<std::string>>(),
        ElementsAre(
            HasSubstr("needs stone.rd.exr (xxh3 "),
            fmt::format("nacre export stone.rd.exr --to {} --out {}", target, target)));
  }
}

TEST_F(Export, RefusesWhatItDoesntKnow) {
  EXPECT_THAT(testing::ErrorMessage([&] { To("arnold"); }, ExitCode::kUsage),
              HasSubstr("psf, sss, cycles, pbrt-v4"));
}

}  // namespace
}  // namespace nacre::exchange

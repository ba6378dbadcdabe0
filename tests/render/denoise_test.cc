// The way to the denoiser and back, by a library that stands in for it.
#include "render/denoise.h"

#include "tests/render/scene_text.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>

#include <cstdlib>

namespace nacre::render::testing {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;

Scene RedBall() {
  return Parse(SceneText(R"(<emitter type="constant"/>
    <shape type="sphere"><float name="radius" value="0.5"/><bsdf type="diffuse">
      <rgb name="reflectance" value="0.8, 0.4, 0.2"/></bsdf></shape>)",
                         "0, 0, 5",
                         "0, 0, 0",
                         9));
}

TEST(FeaturesTest, AreTheAlbedoAndTheNormalOfWhatIsSeen) {
  const FeatureImages features = FirstHitFeatures(RedBall(), 1, 2);
  const auto at = [](const ExrPart& part, std::size_t c, std::size_t pixel) {
    return part.Channel(c)[pixel];
  };
  constexpr std::size_t kMiddle = 4 * 9 + 4;
  EXPECT_NEAR(at(features.albedo, 0, kMiddle), 0.8F, 1e-5F);
  EXPECT_NEAR(at(features.albedo, 2, kMiddle), 0.2F, 1e-5F);
  EXPECT_NEAR(at(features.normal, 2, kMiddle), 1, 0.02F);
  EXPECT_NEAR(at(features.normal, 0, kMiddle), 0, 0.05F);
  // To the right of it the surface faces right, beyond is nothing.
  EXPECT_GT(at(features.normal, 0, kMiddle + 2), 0.3F);
  EXPECT_EQ(at(features.albedo, 0, 0), 0);
  EXPECT_EQ(features.albedo.values, FirstHitFeatures(RedBall(), 1, 1).albedo.values);
}

class DenoiseTest : public ::testing::Test {
 protected:
  DenoiseTest() { setenv("NACRE_OIDN_LIBRARY", NACRE_FAKE_OIDN, 1); }
  ~DenoiseTest() override { unsetenv("NACRE_OIDN_LIBRARY"); }

  static FeatureImages Features(float albedo, float normal) {
    ExrPart a{"albedo", 2, 1, {"R", "G", "B"}, std::vector<float>(6, albedo), {}};
    ExrPart n{"normal", 2, 1, {"X", "Y", "Z"}, std::vector<float>(6, normal), {}};
    return {a, n};
  }
};

TEST_F(DenoiseTest, EachChannelComesBackInItsPlace) {
  const ExrPart image{"", 2, 1, {"R", "G", "B", "A"}, {1, 2, 3, 4, 5, 6, 0.5F, 1}, {}};
  const ExrPart denoised = Denoise(image, Features(0.2F, 0.4F));
  const std::vector<float> expected{1.2F, 2.2F, 3.2F, 4.2F, 5.2F, 6.2F, 0.5F, 1};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_FLOAT_EQ(denoised.values[i], expected[i]) << i;
  }
  const ExrPart grey{"", 2, 1, {"Y"}, {1, 2}, {}};
  EXPECT_FLOAT_EQ(Denoise(grey, Features(0.2F, 0.4F)).values[1], 2.2F);
}

TEST_F(DenoiseTest, ErrorsAreTheLibrarysOrSayWhatIsMissing) {
  const ExrPart image{"", 2, 1, {"R", "G", "B"}, {-1, 2, 3, 4, 5, 6}, {}};
  EXPECT_THAT(ErrorMessage([&] { Denoise(image, Features(0, 0)); }, ExitCode::kFailed),
              HasSubstr("the denoiser failed: a red of -1"));
  setenv("NACRE_OIDN_LIBRARY", "/nowhere/lib.so", 1);
  EXPECT_THAT(ErrorMessage([&] { Denoise(image, Features(0, 0)); }, ExitCode::kUsage),
              HasSubstr("no denoiser: /nowhere/lib.so can't be loaded"));
}

}  // namespace
}  // namespace nacre::render::testing

#include "render/texture.h"

#include <gtest/gtest.h>

namespace nacre::render {
namespace {

// Two columns, three rows; the top row is 1 and 2.
Bitmap Numbered() {
  Bitmap bitmap{2, 3, {}};
  for (int i = 1; i <= 6; ++i) {
    const float v = static_cast<float>(i);
    bitmap.pixels.push_back({v, 10 * v, 0});
  }
  return bitmap;
}

TEST(TextureTest, TheTopRowOfAPictureIsAtVOne) {
  const TexturePtr texture = MakeBitmap(Numbered(), {.nearest = true});
  EXPECT_EQ(texture->At({0.1F, 0.9F}).x, 1);
  EXPECT_EQ(texture->At({0.9F, 0.9F}).x, 2);
  EXPECT_EQ(texture->At({0.1F, 0.1F}).x, 5);
  EXPECT_EQ(texture->At({0.9F, 0.1F}).y, 60);
}

TEST(TextureTest, BilinearAtPixelCentresIsThePixelAndBetweenTheMean) {
  const TexturePtr texture = MakeBitmap(Numbered(), {});
  EXPECT_NEAR(texture->At({0.25F, 0.5F}).x, 3, 1e-5);
  EXPECT_NEAR(texture->At({0.75F, 0.5F}).x, 4, 1e-5);
  EXPECT_NEAR(texture->At({0.5F, 0.5F}).x, 3.5, 1e-5);
  EXPECT_NEAR(texture->At({0.25F, 2.0F / 3}).x, 2, 1e-5);
}

TEST(TextureTest, WrapsAsAsked) {
  const auto at = [](WrapMode mode, float u) {
    return MakeBitmap(Numbered(), {.wrap_u = mode, .wrap_v = mode, .nearest = true})
        ->At({u, 0.9F})
        .x;
  };
  EXPECT_EQ(at(WrapMode::kRepeat, 1.1F), 1);
  EXPECT_EQ(at(WrapMode::kRepeat, -0.1F), 2);
  EXPECT_EQ(at(WrapMode::kMirror, 1.1F), 2);
  EXPECT_EQ(at(WrapMode::kMirror, 1.9F), 1);
  EXPECT_EQ(at(WrapMode::kMirror, -0.1F), 1);
  EXPECT_EQ(at(WrapMode::kClamp, 7), 2);
  EXPECT_EQ(at(WrapMode::kClamp, -7), 1);
  EXPECT_EQ(at(WrapMode::kZero, 1.1F), 0);
  EXPECT_EQ(at(WrapMode::kOne, -0.1F), 1);
  EXPECT_EQ(at(WrapMode::kRepeat, 1e30F), at(WrapMode::kRepeat, 1e30F));
}

TEST(TextureTest, ScalesAndShiftsBeforeTheLookup) {
  const UvMap map{.along_u = {2, 0}, .offset = {0.5F, 0}};
  const TexturePtr texture = MakeBitmap(Numbered(), {.map = map, .nearest = true});
  EXPECT_EQ(texture->At({0.1F, 0.9F}).x, 2);  // u' = 0.7
  EXPECT_EQ(texture->At({0.3F, 0.9F}).x, 1);  // u' = 1.1
}

TEST(TextureTest, CheckerboardHasTwoChecksAUnitStartingWithTheFirstColour) {
  const TexturePtr board = MakeCheckerboard({1, 0, 0}, {0, 1, 0}, {});
  EXPECT_EQ(board->At({0.25F, 0.25F}).x, 1);
  EXPECT_EQ(board->At({0.75F, 0.25F}).x, 0);
  EXPECT_EQ(board->At({0.25F, 0.75F}).x, 0);
  EXPECT_EQ(board->At({0.75F, 0.75F}).x, 1);
  EXPECT_EQ(board->At({-0.25F, 0.25F}).x, 0);
  EXPECT_EQ(board->At({-0.25F, -0.25F}).x, 1);
}

TEST(TextureTest, MeanAndMaximumAreThoseOfThePixels) {
  const TexturePtr texture = MakeBitmap(Numbered(), {});
  EXPECT_NEAR(texture->Mean().x, 3.5, 1e-6);
  EXPECT_EQ(texture->Max().y, 60);
}

}  // namespace
}  // namespace nacre::render

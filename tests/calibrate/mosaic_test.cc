// Planes of a colour mosaic, of all four orders.

#include "calibrate/mosaic.h"

#include "acquire/mosaic.h"
#include "calibrate/internal/light_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace nacre::calibrate {
namespace {

constexpr int kWidth = 12;
constexpr int kHeight = 10;

class MosaicOrders : public ::testing::TestWithParam<const char*> {
 protected:
  // Lasers: red, green with some blue let through, blue and green alike.
  ColourFilters filters() const {
    return {.mosaic = GetParam(),
            .white = {0.5, 1, 0.6},
            .lasers = {{1, 0.05, 0.01}, {0.04, 1, 0.2}, {0, 0.5, 1}}};
  }
};

TEST_P(MosaicOrders, PlanesHaveTheColourOfTheirPixels) {
  const std::string mosaic = GetParam();
  const std::vector<MosaicPlane> planes = PlanesOf(mosaic);
  ASSERT_EQ(planes.size(), 4U);
  int greens = 0;
  for (const MosaicPlane& plane : planes) {
    const char letter = mosaic[static_cast<std::size_t>(2 * plane.row + plane.column)];
    EXPECT_EQ("RGB"[plane.colour], letter);
    EXPECT_EQ(acquire::ColourAt(mosaic, plane.column + 6, plane.row + 4), plane.colour);
    greens += letter == 'G' ? 1 : 0;
  }
  EXPECT_EQ(greens, 2);
}

TEST_P(MosaicOrders, ALaserIsTakenFromTheColoursThatSeeIt) {
  const std::vector<PlaneShare> red = SharesOf(filters(), 0);
  ASSERT_EQ(red.size(), 1U);
  EXPECT_EQ(red[0].plane.colour, 0);
  EXPECT_EQ(red[0].weight, 1);
  const std::vector<PlaneShare> green = SharesOf(filters(), 1);
  ASSERT_EQ(green.size(), 2U);
  EXPECT_EQ(green[0].weight, 0.5);
  const std::vector<PlaneShare> blue = SharesOf(filters(), 2);
  ASSERT_EQ(blue.size(), 3U);
  for (const PlaneShare& share : blue) {
    EXPECT_EQ(share.weight, share.plane.colour == 2 ? 0.5 : 0.25);
  }
  for (const int channel : {0, 1, 2}) {
    const std::vector<float> shares = PixelShares(filters(), channel, kWidth, kHeight);
    EXPECT_FLOAT_EQ(std::accumulate(shares.begin(), shares.end(), 0.0F),
                    kWidth * kHeight);
  }
}

TEST_P(MosaicOrders, APlanesCameraSeesWhatItsPixelsSee) {
  CameraGeometry camera;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.fx_px = 40;
  camera.fy_px = 41;
  camera.cx_px = 5.7;
  camera.cy_px = 4.4;
  camera.k1 = -0.1;
  camera.p1 = 1e-3;
  camera.camera_from_sample_rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  camera.camera_from_sample_translation_mm = {0, 0, 300};
  for (const MosaicPlane& plane : PlanesOf(GetParam())) {
    const CameraGeometry own = PlaneCamera(camera, plane);
    EXPECT_EQ(own.width_px, kWidth / 2);
    EXPECT_EQ(own.height_px, kHeight / 2);
    const PointMm seen = own.SampleFromPixel({3, 2});
    const PointMm whole = camera.SampleFromPixel({6.0 + plane.column, 4.0 + plane.row});
    EXPECT_NEAR(seen.x, whole.x, 1e-9);
    EXPECT_NEAR(seen.y, whole.y, 1e-9);
    const double pixel_mm2 = camera.FootprintMm2({6.0 + plane.column, 4.0 + plane.row});
    EXPECT_NEAR(own.FootprintMm2({3, 2}) / pixel_mm2, 4, 0.01);
  }
}

TEST_P(MosaicOrders, AnEvenLightIsEvenOnceFilledIn) {
  for (const int channel : {0, 1, 2}) {
    std::vector<float> picture(kWidth * kHeight, 3.0F);
    ScaleColours(filters().mosaic,
                 filters().lasers[static_cast<std::size_t>(channel)],
                 kWidth,
                 picture);
    FillIn(filters(), channel, kWidth, picture);
    for (const float value : picture) {
      EXPECT_NEAR(value, 3, 1e-5) << channel;
    }
  }
  std::vector<float> card(kWidth * kHeight, 2.0F);
  ScaleColours(filters().mosaic, filters().white, kWidth, card);
  Balance(filters().mosaic, filters().white, kWidth, card);
  for (const float value : card) {
    EXPECT_NEAR(value, 2, 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(All,
                         MosaicOrders,
                         ::testing::Values("RGGB", "GRBG", "GBRG", "BGGR"));

TEST(Mosaic, AMonochromeSensorIsOnePlane) {
  EXPECT_EQ(PlanesOf("").size(), 1U);
  EXPECT_EQ(SharesOf({}, 2).size(), 1U);
  std::vector<float> picture = {1, 2, 3, 4};
  FillIn({}, 0, 2, picture);
  EXPECT_EQ(picture, (std::vector<float>{1, 2, 3, 4}));
}

// A channel whose spots a mosaic's gaps make differ can't tell speckle.
TEST(LightNoise, AMosaicsGapsAreNoSpeckle) {
  const internal::SpotPowers blind{.pictures = {{1, 1}, {1, 1}},
                                   .noise = 0,
                                   .spread = std::sqrt(5e-4),
                                   .sampling = 1.6e-4,
                                   .pixels_a_spot = 3};
  internal::SpotPowers keen = blind;
  keen.sampling = 0;
  keen.spread = 0.05 / std::sqrt(8.0);
  keen.pixels_a_spot = 8;
  internal::LightNoiseSums alone;
  alone.Add(blind, 1);
  EXPECT_EQ(alone.Result().speckle_contrast, 0);
  alone.Add(keen, 1);
  EXPECT_NEAR(alone.Result().speckle_contrast, 0.05, 1e-12);
}

}  // namespace
}  // namespace nacre::calibrate

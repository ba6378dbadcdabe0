#include "rigs/checkerboard.h"
#include "rigs/pinhole.h"
#include "rigs/plane_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nacre::rigs {
namespace {

PinholeCamera TestCamera() {
  PinholeCamera camera;
  camera.width_px = 120;
  camera.height_px = 100;
  camera.focal_px = 700;
  camera.centre_x_px = 61;
  camera.centre_y_px = 48.5;
  camera.lens = {.k1 = -0.2, .k2 = 0.1, .p1 = 1e-3, .p2 = -2e-3};
  camera.camera_from_sample = LookAtOrigin(500, 0.25, -1.3);
  return camera;
}

// By hand: x = 0.3, y = -0.2, r² = 0.13, radial 1 + 0.13 (-0.2 + 0.13 · 0.1).
TEST(LensDistortion, IsTheWrittenFormula) {
  const LensDistortion lens{.k1 = -0.2, .k2 = 0.1, .p1 = 1e-3, .p2 = -2e-3};
  const double radial = 0.97569;
  const PointMm distorted = lens.Distort({0.3, -0.2});
  EXPECT_NEAR(distorted.x, 0.3 * radial - 2e-3 * 0.06 - 2e-3 * (0.13 + 0.18), 1e-12);
  EXPECT_NEAR(distorted.y, -0.2 * radial + 1e-3 * (0.13 + 0.08) + 4e-3 * 0.06, 1e-12);
}

TEST(LensDistortion, IsUndone) {
  const LensDistortion lens{.k1 = -0.2, .k2 = 0.1, .p1 = 1e-3, .p2 = -2e-3};
  for (const double x : {-0.3, 0.0, 0.2}) {
    for (const double y : {-0.25, 0.1}) {
      const PointMm back = lens.Distort(lens.Undistort({x, y}));
      EXPECT_NEAR(back.x, x, 1e-12);
      EXPECT_NEAR(back.y, y, 1e-12);
    }
  }
}

TEST(Pinhole, PixelsAndSamplePointsAreInverse) {
  const PinholeCamera camera = TestCamera();
  for (const double u : {0.0, 61.0, 119.0}) {
    for (const double v : {0.0, 30.3, 99.0}) {
      const PointMm seen = camera.SampleFromPixel(u, v);
      const PointMm back = camera.PixelFromPoint({seen.x, seen.y, 0});
      EXPECT_NEAR(back.x, u, 1e-9);
      EXPECT_NEAR(back.y, v, 1e-9);
    }
  }
}

TEST(Pinhole, LooksAtTheOriginWithUpUp) {
  PinholeCamera camera = TestCamera();
  const PointMm origin = camera.PixelFromPoint({0, 0, 0});
  EXPECT_NEAR(origin.x, 61, 1e-9);
  EXPECT_NEAR(origin.y, 48.5, 1e-9);
  EXPECT_LT(camera.PixelFromPoint({0, 10, 0}).y, 45);  // up
  EXPECT_GT(camera.PixelFromPoint({10, 0, 0}).x, 65);  // right
  const Vector3 eye = camera.Position();
  EXPECT_NEAR(std::hypot(eye[0], eye[1], eye[2]), 500, 1e-9);
  EXPECT_NEAR(eye[2], 500 * std::cos(0.25), 1e-9);
  EXPECT_NEAR(std::atan2(eye[1], eye[0]), -1.3, 1e-9);
}

TEST(Pinhole, RotationsAreProper) {
  for (int pose = 0; pose < 20; ++pose) {
    const Placement board = BoardPlacement(pose);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) {
        double dot = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          dot += board.rotation[a][k] * board.rotation[b][k];
        }
        EXPECT_NEAR(dot, a == b ? 1 : 0, 1e-12);
      }
    }
    // Tilted by 20 to 30 degrees, but for the flat pose; never seen from behind.
    const double tilt_deg =
        std::acos(std::min(1.0, board.rotation[2][2])) * 180 / std::numbers::pi;
    EXPECT_TRUE(pose == 0 ? tilt_deg == 0 : tilt_deg > 19.9 && tilt_deg < 30.1);
  }
}

TEST(PlaneMap, HoldsWhatPixelsSee) {
  const PinholeCamera camera = TestCamera();
  const PlaneMap map = MapSample(camera);
  const PlaneMap by_rays = MapPlane(MapRays(camera), camera.camera_from_sample);
  for (const auto& [u, v] : {std::pair{0, 0}, {119, 99}, {60, 50}}) {
    const PointMm exact = camera.SampleFromPixel(u + 0.3, v - 0.4);
    const PointMm mapped = map.At(u, v, 0.3, -0.4);
    EXPECT_NEAR(mapped.x, exact.x, 1e-3);
    EXPECT_NEAR(mapped.y, exact.y, 1e-3);
    EXPECT_NEAR(by_rays.x[map.Index(u, v)], map.x[map.Index(u, v)], 2e-4);
    EXPECT_NEAR(by_rays.y[map.Index(u, v)], map.y[map.Index(u, v)], 2e-4);
  }
  EXPECT_NEAR(map.PixelSize(), 500.0 / 700, 0.02);
}

TEST(Checkerboard, IsBlackInTheUpperLeft) {
  const CheckerboardModel board{.columns = 4, .rows = 3, .square_mm = 10};
  EXPECT_EQ(board.ReflectanceAt({-24, 19}), board.black_reflectance);
  EXPECT_EQ(board.ReflectanceAt({-14, 19}), board.white_reflectance);
  EXPECT_EQ(board.ReflectanceAt({-24, 9}), board.white_reflectance);
  EXPECT_EQ(board.ReflectanceAt({-34, 9}), board.white_reflectance);  // margin
  EXPECT_EQ(board.ReflectanceAt({-36, 9}), board.table_reflectance);
}

// The mean over the picture is the mean over the board, edges and all, to what the
// outline of a picture allows; a corner's pixel is half black.
TEST(Checkerboard, IsDrawnByArea) {
  PinholeCamera camera = TestCamera();
  const CheckerboardModel board{.columns = 4, .rows = 3, .square_mm = 10};
  const std::vector<float> image =
      ViewCheckerboard(board, MapRays(camera), camera.camera_from_sample);
  // Along a row through a square's middle, the black width between two white squares
  // must be what the geometry says, to a hundredth of a pixel.
  const PointMm left = camera.PixelFromPoint({-5, 5, 0});
  const PointMm right = camera.PixelFromPoint({5, 5, 0});
  const int row = static_cast<int>(std::lround(0.5 * (left.y + right.y)));
  const auto edge = [&](double x) {
    // The column at which that row meets the vertical edge at x.
    double v = 5;
    PointMm pixel;
    for (int step = 0; step < 20; ++step) {
      pixel = camera.PixelFromPoint({x, v, 0});
      v += (pixel.y - row) * 0.7;
    }
    return pixel.x;
  };
  double black = 0;
  const double contrast = board.white_reflectance - board.black_reflectance;
  const auto begin = static_cast<int>(edge(-5) - 4);
  const auto end = static_cast<int>(edge(5) + 4);
  for (int column = begin; column <= end; ++column) {
    const std::size_t at = static_cast<std::size_t>(row * camera.width_px + column);
    black += (board.white_reflectance - static_cast<double>(image[at])) / contrast;
  }
  const bool is_black = board.ReflectanceAt({0, 5}) == board.black_reflectance;
  const double expected = edge(5) - edge(-5);
  EXPECT_NEAR(is_black ? black : end - begin + 1 - black, expected, 0.08);
}

}  // namespace
}  // namespace nacre::rigs

// Pixels to cells: areas are exact, light is neither lost nor made, a spot's blur goes.

#include "reconstruct/internal/cell_weights.h"

#include "core/random.h"
#include "reconstruct/internal/polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace nacre::reconstruct::internal {
namespace {

TEST(Polygon, PiecesOfAQuadrilateralAddUpToIt) {
  RandomStream random(1, 0);
  for (int trial = 0; trial < 200; ++trial) {
    // Convex: a parallelogram and a little more.
    const double angle = 6.28 * random.Uniform();
    Polygon quad;
    for (int n = 0; n < 4; ++n) {
      const double turn = angle + n * std::numbers::pi / 2 + 0.3 * random.Uniform();
      quad.Add({3 + 1.7 * std::cos(turn), 3 + 1.7 * std::sin(turn)});
    }
    double area = 0;
    double x = 0;
    double y = 0;
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 6; ++column) {
        const Polygon piece = ClipToBox(quad, column, row, column + 1, row + 1);
        const double part = piece.Area();
        if (part > 0) {
          area += part;
          x += part * piece.Centroid().x;
          y += part * piece.Centroid().y;
        }
      }
    }
    EXPECT_NEAR(area, quad.Area(), 1e-12);
    EXPECT_NEAR(x / area, quad.Centroid().x, 1e-9);
    EXPECT_NEAR(y / area, quad.Centroid().y, 1e-9);
  }
}

TEST(Polygon, AreaAndCentroidOfATriangle) {
  Polygon triangle;
  triangle.Add({0, 0});
  triangle.Add({3, 0});
  triangle.Add({0, 6});
  EXPECT_DOUBLE_EQ(triangle.Area(), 9);
  EXPECT_DOUBLE_EQ(triangle.Centroid().x, 1);
  EXPECT_DOUBLE_EQ(triangle.Centroid().y, 2);
}

// A camera straight above, half a millimetre a pixel, turned a little.
calibrate::CameraGeometry Camera(double turn_rad) {
  calibrate::CameraGeometry camera;
  camera.width_px = 90;
  camera.height_px = 80;
  camera.fx_px = 1000;
  camera.fy_px = 1000;
  camera.cx_px = 44.7;
  camera.cy_px = 39.2;
  const double c = std::cos(turn_rad);
  const double s = std::sin(turn_rad);
  // x right, y down, z into the scene: the sample's +y and +z change sign.
  camera.camera_from_sample_rotation = {c, s, 0, s, -c, 0, 0, 0, -1};
  camera.camera_from_sample_translation_mm = {0, 0, 500};
  return camera;
}

RdHeader WeightsHeader() {
  RdHeader header;
  header.points_x = 6;
  header.points_y = 4;
  header.core = 9;
  header.pitch_mm = 2;
  header.channels = {"R"};
  return header;
}

// The mean of `radiance` over each pixel, by sub-sampling.
RateFrame Picture(const calibrate::CameraGeometry& camera,
                  const std::function<double(double, double)>& radiance) {
  constexpr int kSub = 8;
  RateFrame frame;
  for (int row = 0; row < camera.height_px; ++row) {
    for (int column = 0; column < camera.width_px; ++column) {
      double sum = 0;
      for (int k = 0; k < kSub * kSub; ++k) {
        const auto p = camera.SampleFromPixel(
            {column + (k % kSub + 0.5) / kSub - 0.5,
             row + (static_cast<double>(k / kSub) + 0.5) / kSub - 0.5});
        sum += radiance(p.x, p.y);
      }
      frame.rate.push_back(static_cast<float>(sum / (kSub * kSub)));
      frame.variance.push_back(1);
    }
  }
  return frame;
}

calibrate::SpotProfile Round(double sigma_mm) {
  return {.xx_mm2 = sigma_mm * sigma_mm, .yy_mm2 = sigma_mm * sigma_mm};
}

double Gaussian(double x, double y, double variance) {
  return std::exp(-0.5 * (x * x + y * y) / variance) /
         (2 * std::numbers::pi * variance);
}

// The mean over the cell around (x, y): exact, by the error function.
double GaussianCell(double x, double y, double pitch, double variance) {
  const auto part = [&](double at) {
    const double scale = std::sqrt(2 * variance);
    return 0.5 * (std::erf((at + 0.5 * pitch) / scale) -
                  std::erf((at - 0.5 * pitch) / scale));
  };
  return part(x) * part(y) / (pitch * pitch);
}

TEST(CellWeights, EvenLightIsEven) {
  const auto camera = Camera(0.1);
  const CellLattice lattice{WeightsHeader()};
  const CellWeights plain(lattice, camera, {}, 1);
  const CellWeights sharp(lattice, camera, Round(0.3), 1);
  const RateFrame frame = Picture(camera, [](double, double) { return 7.0; });
  for (std::int64_t cell = 0; cell < lattice.CellCount(); ++cell) {
    const auto value = plain.Mean(frame, cell);
    ASSERT_TRUE(value.valid);
    EXPECT_NEAR(value.mean, 7, 1e-5);
    // Sixteen pixels of unit variance a cell, each counted almost alike.
    EXPECT_NEAR(value.variance, 1.0 / 16, 0.02);
    EXPECT_NEAR(sharp.Mean(frame, cell).mean, 7, 1e-5);
    EXPECT_GT(sharp.Mean(frame, cell).variance, value.variance);
  }
}

TEST(CellWeights, APeakTwoPixelsWideIsBinnedExactly) {
  for (const double turn : {0.0, 0.1, 0.7}) {
    const auto camera = Camera(turn);
    const RdHeader header = WeightsHeader();
    const CellLattice lattice{header};
    const CellWeights weights(lattice, camera, {}, 1);
    const double variance = 0.6 * 0.6;
    const RateFrame frame = Picture(
        camera, [&](double x, double y) { return Gaussian(x - 1, y - 1, variance); });
    double total = 0;
    for (int row = 0; row < lattice.rows; ++row) {
      for (int column = 0; column < lattice.columns; ++column) {
        const PointMm centre = lattice.Centre(column, row);
        const auto value = weights.Mean(frame, lattice.Index(column, row));
        EXPECT_NEAR(value.mean,
                    GaussianCell(centre.x - 1, centre.y - 1, 2, variance),
                    0.005 * GaussianCell(0, 0, 2, variance));
        total += value.mean * header.CellAreaMm2();
      }
    }
    EXPECT_NEAR(total, 1, 0.001) << "turn " << turn;
  }
}

TEST(CellWeights, SharpeningUndoesTheSpotsWidth) {
  const auto camera = Camera(0.1);
  const CellLattice lattice{WeightsHeader()};
  const double variance = 0.8 * 0.8;
  const double spot = 0.25;
  const RateFrame blurred = Picture(camera, [&](double x, double y) {
    return Gaussian(x - 1, y - 1, variance + spot * spot);
  });
  const CellWeights plain(lattice, camera, {}, 1);
  const CellWeights sharp(lattice, camera, Round(spot), 1);
  double plain_error = 0;
  double sharp_error = 0;
  for (int row = 0; row < lattice.rows; ++row) {
    for (int column = 0; column < lattice.columns; ++column) {
      const PointMm centre = lattice.Centre(column, row);
      const double truth = GaussianCell(centre.x - 1, centre.y - 1, 2, variance);
      const std::int64_t cell = lattice.Index(column, row);
      plain_error += std::pow(plain.Mean(blurred, cell).mean - truth, 2);
      sharp_error += std::pow(sharp.Mean(blurred, cell).mean - truth, 2);
    }
  }
  EXPECT_LT(std::sqrt(sharp_error), 0.1 * std::sqrt(plain_error));
}

TEST(CellWeights, CellsThatAreNotSeenAreNotValid) {
  auto camera = Camera(0);
  camera.width_px = 40;  // of the 14 columns of cells, the right half is out of view
  const CellLattice lattice{WeightsHeader()};
  const CellWeights weights(lattice, camera, Round(0.1), 1);
  const RateFrame frame = Picture(camera, [](double, double) { return 1.0; });
  EXPECT_TRUE(weights.Mean(frame, lattice.Index(4, 5)).valid);
  EXPECT_FALSE(weights.Mean(frame, lattice.Index(12, 5)).valid);
}

TEST(CellWeights, ASaturatedPixelSpoilsItsCell) {
  const auto camera = Camera(0);
  const CellLattice lattice{WeightsHeader()};
  const CellWeights weights(lattice, camera, {}, 1);
  RateFrame frame = Picture(camera, [](double, double) { return 1.0; });
  const auto pixel = camera.PixelFromSample({1, 1});
  frame.variance[static_cast<std::size_t>(std::lround(pixel.y) * camera.width_px +
                                          std::lround(pixel.x))] = -1;
  int invalid = 0;
  for (std::int64_t cell = 0; cell < lattice.CellCount(); ++cell) {
    invalid += weights.Mean(frame, cell).valid ? 0 : 1;
  }
  EXPECT_EQ(invalid, 1);
}

}  // namespace
}  // namespace nacre::reconstruct::internal

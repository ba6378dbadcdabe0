#include "rigs/laser_view.h"

#include "core/fresnel.h"
#include "rigs/transport/path_averaged.h"
#include "tests/rigs/phantoms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace nacre::rigs {
namespace {

PinholeCamera CloseCamera() {
  PinholeCamera camera;
  camera.width_px = 150;
  camera.height_px = 150;
  camera.focal_px = 2050;  // 0.29 mm a pixel
  camera.centre_x_px = 74.5;
  camera.centre_y_px = 74.5;
  camera.lens = {.k1 = -0.12, .k2 = 0.02, .p1 = 4e-4, .p2 = -3e-4};
  camera.camera_from_sample = LookAtOrigin(600, 0.21, -1.57);
  return camera;
}

// Area of the sample plane that a pixel sees, from its corners.
double FootprintMm2(const PinholeCamera& camera, int column, int row) {
  const PointMm a = camera.SampleFromPixel(column - 0.5, row - 0.5);
  const PointMm b = camera.SampleFromPixel(column + 0.5, row - 0.5);
  const PointMm c = camera.SampleFromPixel(column + 0.5, row + 0.5);
  const PointMm d = camera.SampleFromPixel(column - 0.5, row + 0.5);
  return 0.5 * std::abs((c.x - a.x) * (d.y - b.y) - (d.x - b.x) * (c.y - a.y));
}

struct Sums {
  double flux = 0;
  double x_px = 0;
  double y_px = 0;
};

// ∫ L dA over the picture, and its centre.
Sums Integrate(const PinholeCamera& camera, const std::vector<float>& radiance) {
  Sums sums;
  for (int row = 0; row < camera.height_px; ++row) {
    for (int column = 0; column < camera.width_px; ++column) {
      const auto at = static_cast<std::size_t>(row * camera.width_px + column);
      if (radiance[at] > 0) {
        const double part =
            static_cast<double>(radiance[at]) * FootprintMm2(camera, column, row);
        sums.flux += part;
        sums.x_px += part * column;
        sums.y_px += part * row;
      }
    }
  }
  sums.x_px /= sums.flux;
  sums.y_px /= sums.flux;
  return sums;
}

Phantom Lit(const Phantom& phantom, double sigma_mm) {
  Phantom lit = phantom;
  lit.beam = {.shape = BeamShape::kGaussian, .width_mm = 4 * sigma_mm};
  return lit;
}

// A spot on the reference integrates to ρΦ/π, wherever within a pixel it falls and
// however small it is, and is where the geometry says.
TEST(LaserView, ReferenceSpotsKeepTheirFluxAndPlace) {
  const PinholeCamera camera = CloseCamera();
  for (const double sigma_mm : {0.05, 0.12, 0.5}) {
    const LaserView view(
        camera,
        std::make_shared<PathAveraged>(Lit(testing::Homogeneous(0.1, 3, 10), sigma_mm)),
        sigma_mm);
    for (const PointMm centre : {PointMm{0, 0}, {3.17, -2.06}, {-8.4, 9.9}}) {
      const std::vector<Spot> spot = {{centre, 1}};
      const Sums sums = Integrate(camera, view.OnReference(spot, 7, 0.9));
      EXPECT_NEAR(sums.flux / (0.9 * 7 / std::numbers::pi), 1, 1e-3) << sigma_mm;
      if (sigma_mm > 0.1) {  // a smaller spot's centre is hidden within its pixel
        const PointMm pixel = camera.PixelFromPoint({centre.x, centre.y, 0});
        EXPECT_NEAR(sums.x_px, pixel.x, 0.015);
        EXPECT_NEAR(sums.y_px, pixel.y, 0.015);
      }
    }
  }
}

// What leaves the sample: Σ L · πc / F_t(θ_o) over the plane is Φ F_t(θ_i) R.
TEST(LaserView, SampleSpotsKeepTheEnergy) {
  const PinholeCamera camera = CloseCamera();
  const Phantom phantom = testing::Homogeneous(0.1, 3, 10);
  const auto model = std::make_shared<PathAveraged>(Lit(phantom, 0.12));
  const LaserView view(camera, model, 0.12);
  const Vector3 eye = camera.Position();
  for (const PointMm centre : {PointMm{0, 0}, {3.17, -2.06}}) {
    const std::vector<Spot> spot = {{centre, 0.98}};
    std::vector<float> exitance = view.OnSample(spot, 7, 0);
    for (int k = 0; k < camera.width_px * camera.height_px; ++k) {
      const PointMm p = camera.SampleFromPixel(
          k % camera.width_px, static_cast<double>(k / camera.width_px));
      const double cosine = eye[2] / std::hypot(eye[0] - p.x, eye[1] - p.y, eye[2]);
      exitance[static_cast<std::size_t>(k)] *=
          static_cast<float>(std::numbers::pi * ExitNormalization(1.5) /
                             FresnelTransmittance(cosine, 1.5));
    }
    const double entered = 7 * FresnelTransmittance(0.98, 1.5);
    EXPECT_NEAR(Integrate(camera, exitance).flux /
                    (entered * model->TotalsAt(centre, 0).reflected),
                1,
                3e-3);
  }
}

// Tiles stand for their pixels, borders of media and of the picture included: pixel by
// pixel the model itself, everywhere but where a pixel is a mean over its footprint.
TEST(LaserView, TilesAreTheModelAtEachPixel) {
  PinholeCamera camera = CloseCamera();
  camera.width_px = 171;  // not a number of whole tiles
  camera.height_px = 140;
  const PlaneMap map = MapSample(camera);
  for (const PatternType type :
       {PatternType::kHomogeneous, PatternType::kChessboard, PatternType::kStripes}) {
    const Phantom phantom =
        Lit(type == PatternType::kHomogeneous ? testing::Homogeneous(0.0021, 2.19, 10)
                                              : testing::TwoMarbles(type, 9),
            0.12);
    const auto model = std::make_shared<PathAveraged>(phantom);
    const LaserView view(camera, model, 0.12);
    for (const PointMm centre : {PointMm{0.4, -1.3}, {-14, 11}, {40, 3}}) {
      const std::vector<float> seen = view.OnSample(std::vector{Spot{centre, 1}}, 1, 0);
      std::vector<float> exitance(map.x.size(), 0.0F);
      model->AddExitance(centre,
                         0,
                         FresnelTransmittance(1, 1.5),
                         {map.x.data(), map.y.data(), map.x.size()},
                         exitance.data());
      double worst = 0;
      double sum2 = 0;
      double count = 0;
      for (std::size_t k = 0; k < seen.size(); ++k) {
        const double r = std::hypot(static_cast<double>(map.x[k]) - centre.x,
                                    static_cast<double>(map.y[k]) - centre.y);
        if (r < 15 * map.PixelSize() || r > model->ReachMm(0)) {
          continue;
        }
        const Vector3 eye = camera.Position();
        const double cosine =
            eye[2] / std::hypot(eye[0] - static_cast<double>(map.x[k]),
                                eye[1] - static_cast<double>(map.y[k]),
                                eye[2]);
        const double expected = static_cast<double>(exitance[k]) *
                                FresnelTransmittance(cosine, 1.5) /
                                (std::numbers::pi * ExitNormalization(1.5));
        const double error = static_cast<double>(seen[k]) / expected - 1;
        worst = std::max(worst, std::abs(error));
        sum2 += error * error;
        count += 1;
      }
      EXPECT_LT(worst, 0.02) << Name(type);
      EXPECT_LT(std::sqrt(sum2 / count), 6e-4) << Name(type);
    }
  }
}

TEST(LaserView, LightAddsUp) {
  const PinholeCamera camera = CloseCamera();
  const auto model = std::make_shared<PathAveraged>(
      Lit(testing::TwoMarbles(PatternType::kChessboard, 4), 0.12));
  const LaserView view(camera, model, 0.12, 1);
  const LaserView view_on_threads(camera, model, 0.12, 3);
  const Spot a{{1, 2}, 1};
  const Spot b{{-4, -3}, 0.99};
  const std::vector<float> both = view.OnSample(std::vector{a, b}, 2, 0);
  const std::vector<float> of_a = view.OnSample(std::vector{a}, 1, 0);
  const std::vector<float> of_b = view.OnSample(std::vector{b}, 1, 0);
  for (std::size_t k = 0; k < both.size(); ++k) {
    ASSERT_NEAR(both[k], 2 * (of_a[k] + of_b[k]), 1e-5F * both[k] + 1e-12F);
  }
  EXPECT_EQ(view_on_threads.OnSample(std::vector{a, b}, 2, 0), both);
}

}  // namespace
}  // namespace nacre::rigs

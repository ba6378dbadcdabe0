#include "calibrate/laser_map.h"

#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace nacre::calibrate {
namespace {

// Gaussian spots, each pixel the mean over its square, by error functions.
std::vector<float> DrawSpots(const std::vector<PixelPoint>& spots,
                             double sigma_px,
                             double flux,
                             int size) {
  const auto share = [&](double centre, int k) {
    const double scale = 1 / (sigma_px * std::numbers::sqrt2);
    return 0.5 * (std::erf((k + 0.5 - centre) * scale) -
                  std::erf((k - 0.5 - centre) * scale));
  };
  std::vector<float> picture;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      double sum = 0;
      for (const PixelPoint& spot : spots) {
        sum += flux * share(spot.x, x) * share(spot.y, y);
      }
      picture.push_back(static_cast<float>(sum));
    }
  }
  return picture;
}

std::vector<PixelPoint> Lattice(RandomStream& random) {
  std::vector<PixelPoint> spots;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      spots.push_back(
          {20 + 25 * column + random.Uniform(), 20 + 25 * row + random.Uniform()});
    }
  }
  return spots;
}

double Farthest(const std::vector<PixelPoint>& expected,
                const std::vector<PixelPoint>& found) {
  double farthest = 0;
  for (const PixelPoint& e : expected) {
    double nearest = 1e9;
    for (const PixelPoint& f : found) {
      nearest = std::min(nearest, std::hypot(e.x - f.x, e.y - f.y));
    }
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

class FindSpotsOfSizes : public ::testing::TestWithParam<double> {};

TEST_P(FindSpotsOfSizes, CentroidsWithoutNoiseAreExact) {
  RandomStream random(3, 0);
  const std::vector<PixelPoint> spots = Lattice(random);
  const auto found = FindSpots(DrawSpots(spots, GetParam(), 1e4, 90), 90, 90, 9);
  ASSERT_EQ(found.size(), 9U);
  // But for aliasing: the pixels' own centroid is off by exp(-2 π² σ²) / π along each
  // axis at most, the first harmonic of a sampled Gaussian.
  const double sigma_px = GetParam();
  const double aliasing_px =
      std::exp(-2 * std::numbers::pi * std::numbers::pi * sigma_px * sigma_px) /
      std::numbers::pi;
  EXPECT_LT(Farthest(spots, found), 0.005 + std::numbers::sqrt2 * aliasing_px);
}

TEST_P(FindSpotsOfSizes, CentroidsSurviveNoiseAndGround) {
  RandomStream random(4, 0);
  const std::vector<PixelPoint> spots = Lattice(random);
  std::vector<float> picture = DrawSpots(spots, GetParam(), 2e4, 90);
  for (float& value : picture) {  // ± 20 counts, 11.5 rms, on a ground of 30
    value += 30 + 20 * (2 * random.UniformFloat() - 1);
  }
  const auto found = FindSpots(picture, 90, 90, 9);
  ASSERT_EQ(found.size(), 9U);
  // Noise of a centroid along one axis over a disc of radius r: σ √(π/4) r² / flux.
  // Three times that; the disc is about what 25 pixels between spots allow.
  const double radius_px = std::min(11.0, 3.4 * std::hypot(GetParam(), 1.0) + 1);
  const double noise_px =
      11.5 * std::sqrt(std::numbers::pi / 4) * radius_px * radius_px / 2e4;
  EXPECT_LT(Farthest(spots, found), 3 * noise_px + 0.04);
}

INSTANTIATE_TEST_SUITE_P(SigmasPx,
                         FindSpotsOfSizes,
                         ::testing::Values(0.35, 0.7, 1.5, 3.0));

TEST(FindSpots, AnotherNumberIsNoAnswer) {
  RandomStream random(5, 0);
  const auto picture = DrawSpots(Lattice(random), 1, 1e4, 90);
  EXPECT_TRUE(FindSpots(picture, 90, 90, 8).empty());
  EXPECT_TRUE(FindSpots(picture, 90, 90, 10).empty());
  EXPECT_TRUE(FindSpots(std::vector<float>(8100, 0), 90, 90, 9).empty());
}

TEST(FitScanMap, ACubicScannerIsFitExactlyOneWayAndNearlyTheOther) {
  std::vector<acquire::ScanAngle> angles;
  std::vector<PointMm> points;
  const auto laser = [](acquire::ScanAngle a) {
    return PointMm{300 * a.x_rad + 40 * a.x_rad * a.y_rad * a.y_rad + 2,
                   290 * a.y_rad - 5 * a.x_rad + 60 * a.x_rad * a.x_rad - 1};
  };
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) {
      angles.push_back({0.03 * i, 0.03 * j});
      points.push_back(laser(angles.back()));
    }
  }
  const LaserMapResult result = FitScanMap(angles, points);
  EXPECT_LT(result.rms_mm, 1e-10);
  const PointMm target{12, -17};
  const PointMm hit = laser(result.map.AngleFromSample(target));
  EXPECT_NEAR(hit.x, target.x, 5e-3);
  EXPECT_NEAR(hit.y, target.y, 5e-3);
}

TEST(FitScanMap, ResidualIsThatOfTheMisplacedSpot) {
  std::vector<acquire::ScanAngle> angles;
  std::vector<PointMm> points;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      angles.push_back({0.02 * i, 0.02 * j});
      points.push_back({6.0 * i, 6.0 * j});
    }
  }
  points[40].x += 1;  // the middle one
  const LaserMapResult result = FitScanMap(angles, points);
  EXPECT_GT(result.max_mm, 0.9);
  EXPECT_LT(result.max_mm, 1.0);
  EXPECT_NEAR(result.rms_mm, 1.0 / 9, 0.01);  // √(1 / 81), less what the fit takes up
}

}  // namespace
}  // namespace nacre::calibrate

// Glare by Gaussians, against the solution in the Fourier domain.

#include "reconstruct/internal/glare_pyramid.h"

#include "calibrate/glare.h"
#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace nacre::reconstruct::internal {
namespace {

// A power law of the distance that holds `fraction` of the light.
calibrate::Glare PowerLaw(double exponent, double fraction) {
  calibrate::Glare glare;
  const double first_px = 4.6;
  const double last_px = 130;
  double sum = 0;
  for (double r = 0.5 + first_px; r < last_px; r += 0.1) {
    sum += 0.1 * 2 * std::numbers::pi * r * std::pow(r, -exponent);
  }
  for (double r = first_px; r < last_px; r *= 1.3) {
    glare.radius_px.push_back(r);
    glare.density_per_px2.push_back(fraction * std::pow(r, -exponent) / sum);
  }
  glare.fraction = fraction;
  return glare;
}

// A spot a pixel wide with a tail around it, as on a translucent sample.
std::vector<float> Spot(int width, int height, std::uint64_t seed) {
  std::vector<float> picture(static_cast<std::size_t>(width * height));
  RandomStream random(seed, 0);
  const double cx = 0.5 * width + 8 * random.Uniform();
  const double cy = 0.5 * height + 8 * random.Uniform();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double r = std::hypot(x - cx, y - cy);
      picture[static_cast<std::size_t>(y * width + x)] = static_cast<float>(
          100 * std::exp(-0.5 * r * r) + 10 * std::exp(-r / 12) / (1 + r));
    }
  }
  return picture;
}

// The sum over three bins by three, about a cell's size.
double CellSum(const BinnedPicture& picture, int x, int y) {
  double sum = 0;
  for (int k = 0; k < 9; ++k) {
    sum += static_cast<double>(
        picture
            .values[static_cast<std::size_t>((y + k / 3) * picture.width + x + k % 3)]);
  }
  return sum;
}

// The rms error relative to a cell's glare, as far as a kernel that ends at half a
// picture's width can be told.
double RelativeError(const calibrate::Glare& glare,
                     int width,
                     int height,
                     std::uint64_t seed) {
  const std::vector<float> seen = Spot(width, height, seed);
  const GlarePyramid pyramid(glare, width, height);
  BinnedPicture sums(width, height);
  sums.Fill(seen, width);
  const BinnedPicture scattered = pyramid.Scattered(sums);

  std::vector<float> clean = seen;
  calibrate::RemoveGlare(glare, width, height, clean);
  std::vector<float> expected(seen.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    expected[k] =
        0.25F * (seen[k] / static_cast<float>(1 - pyramid.fraction()) - clean[k]);
  }
  BinnedPicture oracle(width, height);
  oracle.Fill(expected, width);
  double square = 0;
  double count = 0;
  for (int y = 0; y + 3 < height / 2; y += 3) {
    for (int x = 0; x + 3 < width / 2; x += 3) {
      if (std::hypot(2 * x + 3 - width / 2, 2 * y + 3 - height / 2) < 0.35 * width) {
        const double truth = CellSum(oracle, x, y);
        square += std::pow(CellSum(scattered, x, y) / truth - 1, 2);
        count += 1;
      }
    }
  }
  return std::sqrt(square / count);
}

TEST(GlarePyramid, AgreesWithTheFourierSolution) {
  for (const double exponent : {2.0, 2.5, 3.0}) {
    for (const auto& [width, height] : {std::pair{272, 272}, {201, 130}}) {
      for (const std::uint64_t seed : {1U, 2U}) {
        EXPECT_LT(RelativeError(PowerLaw(exponent, 0.03), width, height, seed),
                  GlarePyramid::kError)
            << "r^-" << exponent << ", " << width << " x " << height;
      }
    }
  }
}

TEST(GlarePyramid, IsLinearAndKeepsEvenLightEven) {
  const GlarePyramid pyramid(PowerLaw(2.5, 0.03), 128, 128);
  BinnedPicture even(128, 128);
  std::fill(even.values.begin(), even.values.end(), 4.0F);
  const BinnedPicture once = pyramid.Scattered(even);
  std::fill(even.values.begin(), even.values.end(), 8.0F);
  const BinnedPicture twice = pyramid.Scattered(even);
  for (std::size_t k = 0; k < once.values.size(); ++k) {
    EXPECT_EQ(twice.values[k], 2 * once.values[k]);
  }
  // Far from the rim nothing is lost but what is scattered beyond it.
  const float middle = once.values[static_cast<std::size_t>(32 * once.width + 32)];
  const double all = pyramid.fraction() / (1 - pyramid.fraction());
  EXPECT_GT(middle, 0.65 * all);
  EXPECT_LT(middle, 1.01 * all);
}

TEST(GlarePyramid, NothingKnownIsNothing) {
  const GlarePyramid pyramid({}, 64, 64);
  EXPECT_TRUE(pyramid.empty());
  EXPECT_EQ(pyramid.fraction(), 0.0);
}

}  // namespace
}  // namespace nacre::reconstruct::internal

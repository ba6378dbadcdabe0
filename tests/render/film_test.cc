#include "render/film.h"

#include "render/accumulator.h"
#include "render/camera.h"
#include "render/sampler.h"

#include <gtest/gtest.h>

#include <limits>

namespace nacre::render {
namespace {

// Second moment of offsets along x, with weights: that of the filter.
double SecondMoment(const Film& film, double& mean_weight) {
  const FilterSampler filter(film);
  constexpr std::uint32_t kCount = 1u << 16;
  double moment = 0;
  double weight = 0;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    Sampler sampler(1, i);
    const FilterSampler::Sample s = filter(sampler.Next2D());
    EXPECT_LE(std::abs(s.offset.x), film.filter_radius);
    weight += static_cast<double>(s.weight);
    moment += static_cast<double>(s.weight * s.offset.x * s.offset.x);
  }
  mean_weight = weight / kCount;
  return moment / kCount;
}

Film FilmWith(FilterKind kind) {
  Film film;
  film.filter = kind;
  film.filter_radius = DefaultRadius(kind);
  return film;
}

TEST(FilmTest, FiltersHaveTheirMomentsAndWeightOne) {
  double weight = 0;
  EXPECT_NEAR(SecondMoment(FilmWith(FilterKind::kBox), weight), 1.0 / 12, 1e-4);
  EXPECT_NEAR(weight, 1, 1e-6);
  EXPECT_NEAR(SecondMoment(FilmWith(FilterKind::kTent), weight), 1.0 / 6, 1e-4);
  EXPECT_NEAR(weight, 1, 1e-6);
  // ∫ x² g / ∫ g of the lowered Gaussian, by hand: 0.2486 instead of σ² = 0.25.
  EXPECT_NEAR(SecondMoment(FilmWith(FilterKind::kGaussian), weight), 0.2486, 1e-3);
  EXPECT_NEAR(weight, 1, 1e-6);
  // Cubics with B + 2 C = 1 have B / 3: from the B-spline's 1/3 at B = 1 to
  // Catmull–Rom's 0, which keeps parabolas, at B = 0.
  EXPECT_NEAR(SecondMoment(FilmWith(FilterKind::kMitchell), weight), 1.0 / 9, 3e-3);
  EXPECT_NEAR(weight, 1, 2e-3);
  EXPECT_NEAR(SecondMoment(FilmWith(FilterKind::kCatmullRom), weight), 0, 3e-3);
  EXPECT_NEAR(weight, 1, 2e-3);
}

TEST(AccumulatorTest, LeavesOutWhatIsNotFinite) {
  Film film;
  film.crop_width = 2;
  film.crop_height = 1;
  Accumulator sums(film);
  EXPECT_TRUE(sums.Add(0, {1, 2, 3}, 1, 1));
  EXPECT_FALSE(sums.Add(0, {std::numeric_limits<float>::quiet_NaN(), 0, 0}, 1, 1));
  EXPECT_FALSE(sums.Add(1, {0, std::numeric_limits<float>::infinity(), 0}, 1, 1));
  EXPECT_TRUE(sums.Add(1, {2, 2, 2}, 1, 1));
  const ExrPart image = sums.ToImage();
  EXPECT_EQ(image.Channel(0)[0], 1);
  EXPECT_EQ(image.Channel(2)[0], 3);
  EXPECT_EQ(image.Channel(1)[1], 2);
}

TEST(AccumulatorTest, EstimatesTheErrorThatIndependentSamplesLeave) {
  Film film;
  film.crop_width = 1;
  film.crop_height = 1;
  Accumulator sums(film);
  EXPECT_TRUE(std::isinf(sums.RelativeError()));
  // 1, 3, 1, 3: mean 2, variance of the mean 4/3 / 4, so relative error √(1/3) / 2.
  for (const float v : {1.0F, 3.0F, 1.0F, 3.0F}) {
    sums.Add(0, {v, v, v}, 1, 1);
  }
  EXPECT_NEAR(sums.RelativeError(), std::sqrt(1.0 / 3) / 2, 1e-6);
}

TEST(AccumulatorTest, WritesTheChannelsOfTheFormat) {
  Film film;
  film.crop_width = 1;
  film.crop_height = 1;
  film.format = PixelFormat::kLuminanceAlpha;
  Accumulator sums(film);
  sums.Add(0, {1, 1, 1}, 0.5F, 1);
  const ExrPart image = sums.ToImage();
  EXPECT_EQ(image.channels, (std::vector<std::string>{"Y", "A"}));
  EXPECT_NEAR(image.Channel(0)[0], 1, 1e-6);
  EXPECT_EQ(image.Channel(1)[0], 0.5F);
}

TEST(CameraTest, TheFirstPixelIsUpAndLeft) {
  Camera camera;
  camera.world_from_camera = Transform::LookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0});
  camera.half_width = HalfWidth(90, FovAxis::kX, 200, 100);
  const Ray ray = CameraRay(camera, {0, 0}, 200, 100);
  EXPECT_NEAR(ray.direction.x / -ray.direction.z, -1, 1e-6);
  EXPECT_NEAR(ray.direction.y / -ray.direction.z, 0.5, 1e-6);
  const Ray centre = CameraRay(camera, {100, 50}, 200, 100);
  EXPECT_NEAR(centre.direction.z, -1, 1e-6);
}

TEST(CameraTest, TheFieldOfViewIsAlongItsAxis) {
  EXPECT_NEAR(HalfWidth(90, FovAxis::kX, 200, 100), 1, 1e-6);
  EXPECT_NEAR(HalfWidth(90, FovAxis::kY, 200, 100), 2, 1e-6);
  EXPECT_NEAR(HalfWidth(90, FovAxis::kSmaller, 200, 100), 2, 1e-6);
  EXPECT_NEAR(HalfWidth(90, FovAxis::kLarger, 200, 100), 1, 1e-6);
  EXPECT_NEAR(HalfWidth(90, FovAxis::kDiagonal, 300, 400), 0.6, 1e-6);
}

}  // namespace
}  // namespace nacre::render

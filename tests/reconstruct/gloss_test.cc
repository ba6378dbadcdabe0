#include "reconstruct/internal/gloss.h"

#include "core/random.h"
#include "reconstruct/internal/fill_diagonal.h"
#include "reconstruct/internal/gloss_fit.h"
#include "reconstruct/internal/nonnegative_fit.h"
#include "reconstruct/internal/polygon.h"
#include "reconstruct/internal/sharpener.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

TEST(FitNonnegative, OfIndependentColumnsIsTheirPositivePart) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(4, 3);
  const Eigen::VectorXd x = FitNonnegative(a, Eigen::Vector4d(2, -1, 0.5, 7));
  EXPECT_NEAR(x(0), 2, 1e-12);
  EXPECT_EQ(x(1), 0);
  EXPECT_NEAR(x(2), 0.5, 1e-12);
}

// At the minimum the gradient is 0 where x isn't, and not downhill
// elsewhere.
TEST(FitNonnegative, MeetsTheConditionsOfTheMinimum) {
  Eigen::MatrixXd a(12, 5);
  Eigen::VectorXd b(12);
  for (int i = 0; i < 12; ++i) {
    for (int k = 0; k < 5; ++k) {
      a(i, k) = std::exp(-0.3 * i * (k + 1)) + 0.1 * std::cos(7.0 * i + k);
    }
    b(i) = 1.5 * a(i, 0) - 0.7 * a(i, 2) + 0.4 * a(i, 4) + 0.05 * std::sin(3.0 * i);
  }
  const Eigen::VectorXd x = FitNonnegative(a, b);
  const Eigen::VectorXd gradient = a.transpose() * (b - a * x);
  int positive = 0;
  for (int k = 0; k < 5; ++k) {
    EXPECT_GE(x(k), 0);
    positive += x(k) > 0 ? 1 : 0;
    if (x(k) > 0) {
      EXPECT_NEAR(gradient(k), 0, 1e-9);
    } else {
      EXPECT_LE(gradient(k), 1e-9);
    }
  }
  EXPECT_GT(positive, 0);
  EXPECT_LT(positive, 5);
}

TEST(Polygon, MeanSquaresOfARectangle) {
  Polygon box;
  for (const auto& [x, y] : {std::pair(1.0, 2.0), {3.0, 2.0}, {3.0, 2.5}, {1.0, 2.5}}) {
    box.Add({x, y});
  }
  const Polygon::Squares squares = box.MeanSquares();
  EXPECT_NEAR(squares.xx, 4 + 4.0 / 12, 1e-12);
  EXPECT_NEAR(squares.yy, 2.25 * 2.25 + 0.25 / 12, 1e-12);
  EXPECT_NEAR(squares.xy, 2 * 2.25, 1e-12);
}

// The inverse of a blur has the negative of its moments.
TEST(Sharpener, HasTheNegativeMomentsOfTheSpot) {
  calibrate::CameraGeometry camera;
  camera.width_px = camera.height_px = 21;
  camera.fx_px = camera.fy_px = 100;
  camera.cx_px = camera.cy_px = 10;
  camera.camera_from_sample_rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  camera.camera_from_sample_translation_mm = {0, 0, 50};  // half a millimetre a pixel
  const calibrate::SpotProfile spot{.xx_mm2 = 0.16, .xy_mm2 = 0.03, .yy_mm2 = 0.11};
  constexpr int kSide = 11;
  std::vector<double> weights(kSide * kSide, 0.0);
  weights[kSide * 5 + 5] = 1;
  Sharpener(spot, camera).Apply(weights, kSide, kSide);
  double sum = 0;
  double xx = 0;
  double xy = 0;
  double yy = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    const double x = 0.5 * (k % kSide - 5);
    const double y = -0.5 * (k / kSide - 5);
    const double w = weights[static_cast<std::size_t>(k)];
    sum += w;
    xx += w * x * x;
    xy += w * x * y;
    yy += w * y * y;
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_NEAR(xx, -spot.xx_mm2, 1e-9);
  EXPECT_NEAR(xy, -spot.xy_mm2, 1e-9);
  EXPECT_NEAR(yy, -spot.yy_mm2, 1e-9);
}

TEST(Gloss, DensityOfAGaussianIsExactBetweenItsRings) {
  Gloss gloss;
  for (const double r2 : {0.0, 0.1, 0.4, 0.9}) {
    gloss.square_mm2.push_back(r2);
    gloss.log_density.push_back(std::log(3.0) - r2 / 0.2);
  }
  EXPECT_NEAR(gloss.Density(0.25), 3 * std::exp(-1.25), 1e-12);
  EXPECT_NEAR(gloss.Density(0.05), 3 * std::exp(-0.25), 1e-12);
  EXPECT_EQ(gloss.Density(1.0), 0);
}

constexpr double kSpotMm = 0.23;
constexpr double kRingMm = 0.1;

// Rings of a radial profile, f(r²) a pixel, with so much relative noise.
template <class Profile>
SpotRings RingsOf(Profile&& profile, double noise, RandomStream& random) {
  SpotRings rings;
  for (std::size_t k = 0; k < SpotRings::kCount; ++k) {
    const double r = kRingMm * (static_cast<double>(k) + 0.55);
    const double pixels = 40 * (static_cast<double>(k) + 1);
    rings.pixels[k] = static_cast<float>(pixels);
    rings.square_mm2[k] = static_cast<float>(pixels * r * r);
    rings.sum[k] = static_cast<float>(pixels * profile(r * r) *
                                      (1 + noise * (random.Uniform() - 0.5)));
  }
  return rings;
}

// Light scattered once: events at all depths, also right below the surface, which a
// mixture of dipoles from some depth on doesn't have; and a dipole.
double Inside(double r2, double mean_depth_mm, double single) {
  const auto dipole = [&](double z) {
    const double d2 = r2 + z * z + kSpotMm * kSpotMm;  // nearly its blur
    const double d = std::sqrt(d2);
    return z * (1 + 0.5 * d / z) * std::exp(-0.5 * d / z) / (6.28 * d2 * d);
  };
  double once = 0;
  for (double t = 0.125; t < 3; t += 0.25) {
    once += 0.25 * std::exp(-t) * dipole(t * mean_depth_mm);
  }
  return (1 - single) * dipole(mean_depth_mm) + single * once;
}

// Three channels of darker and darker media; half of the spots in each lie in another.
std::vector<SpotsOfChannel> Skin(const std::vector<double>& gloss, double single) {
  RandomStream random(5, 0);
  const auto spot = [](double r2) {
    return std::exp(-0.5 * r2 / (kSpotMm * kSpotMm)) / (6.283 * kSpotMm * kSpotMm);
  };
  std::vector<SpotsOfChannel> channels;
  for (std::size_t c = 0; c < gloss.size(); ++c) {
    SpotsOfChannel& channel = channels.emplace_back();
    channel.reference = RingsOf(spot, 1e-3, random);
    for (int n = 0; n < 96; ++n) {
      const double depth =
          (n % 2 == 0 ? 1.2 : 1.0) / (1 + 0.35 * static_cast<double>(c));
      const double albedo = 0.7 / (1 + static_cast<double>(c)) - 0.05 * (n % 3);
      channel.spots.push_back(RingsOf(
          [&](double r2) {
            return gloss[c] * spot(r2) + albedo * Inside(r2, depth, single);
          },
          0.01,
          random));
    }
  }
  return channels;
}

TEST(FitGloss, TellsItFromLightThatComesOutCloseBy) {
  for (const Estimate& e : FitGloss(Skin({0.05, 0.05, 0.05}, 0), 1.4)) {
    EXPECT_NEAR(e.value, 0.05, 0.0012);
    EXPECT_NEAR(e.value, 0.05, 3 * e.sigma);
  }
}

TEST(FitGloss, FindsNoneWhereThereIsNone) {
  for (const Estimate& e : FitGloss(Skin({0, 0, 0}, 0), 1.4)) {
    EXPECT_LT(std::abs(e.value), 3 * e.sigma + 2e-4);
  }
}

TEST(FitGloss, AChannelThatDiffersKeepsItsOwn) {
  const std::vector<Estimate> found = FitGloss(Skin({0.05, 0.02, 0.05}, 0), 1.4);
  EXPECT_NEAR(found[0].value, 0.05, 0.002);
  EXPECT_NEAR(found[1].value, 0.02, 3 * found[1].sigma);
  EXPECT_LT(found[1].value, 0.03);  // nearer to its own than to the others'
}

// Light scattered once comes out nearer than the spot is wide as well; what isn't told
// apart is what there is of it, a known share.
TEST(FitGloss, SingleScatteringCountsAsGlossOnlyWhereItIsNearerThanTheSpot) {
  for (const Estimate& e : FitGloss(Skin({0.05, 0.05, 0.05}, 0.3), 1.4)) {
    EXPECT_GT(e.value, 0.05 - 3 * e.sigma);
    EXPECT_LT(e.value, 0.05 + 0.3 * 0.7 * 0.25);
  }
}

TEST(Pool, OfEstimatesThatAgreeIsTheWeightedMean) {
  const Pooled pooled = Pool({{1.0, 0.1}, {1.1, 0.2}});
  EXPECT_EQ(pooled.tau2, 0);
  EXPECT_NEAR(pooled.mean.value, (1.0 * 100 + 1.1 * 25) / 125, 1e-12);
  EXPECT_NEAR(pooled.mean.sigma, 1 / std::sqrt(125.0), 1e-12);
}

// As in the paper's method of moments: of two, τ² is half their squared difference less
// the mean variance.
TEST(Pool, OfEstimatesThatDisagreeIsAsUncertainAsTheyAreApart) {
  const Pooled pooled = Pool({{0.0, 0.1}, {2.0, 0.1}});
  EXPECT_NEAR(pooled.tau2, 0.5 * 4 - 0.01, 1e-9);
  EXPECT_NEAR(pooled.mean.sigma, 1, 1e-9);
}

// Of light that falls off like a dipole's, not like the line that is drawn through it.
TEST(FillDiagonal, SigmaIsAsLargeAsTheGuessIsOff) {
  RdHeader header;
  header.points_x = header.points_y = 1;
  header.core = 11;
  header.pitch_mm = 0.5;
  header.channels = {"R"};
  const auto truth = [&](int u, int v) {
    const double r = 0.5 * std::hypot(u, v);
    const double d = std::hypot(r, 1.0);
    return std::exp(-d) * (1 + d) / (d * d * d);
  };
  for (const double radius : {0.0, 1.0, 1.5}) {
    RdSlice slice = MakeSlice(header);
    for (int k = 0; k < 121; ++k) {
      slice.rd[static_cast<std::size_t>(k)] =
          static_cast<float>(truth(k % 11 - 5, k / 11 - 5));
    }
    FillDiagonal(header, radius, slice);
    for (int k = 0; k < 121; ++k) {
      const auto at = static_cast<std::size_t>(k);
      if (slice.valid[at] == 0) {
        const double off =
            static_cast<double>(slice.rd[at]) - truth(k % 11 - 5, k / 11 - 5);
        EXPECT_GT(slice.sigma[at], 0);
        EXPECT_LT(std::abs(off), 1.5 * static_cast<double>(slice.sigma[at]));
        EXPECT_LT(slice.sigma[at], slice.rd[at]);
      }
    }
  }
}

TEST(Gloss, IsToldOfWhereItStandsOutOfItsUncertainty) {
  const Gloss gloss{.reflectance = {0.05, 0.001}, .sigma = {0.002, 0.001}};
  const std::string text = gloss.Warning({"R", "G"});
  EXPECT_NE(text.find("5.00 +- 0.20 % in R"), std::string::npos) << text;
  EXPECT_EQ(text.find("in G"), std::string::npos) << text;
  EXPECT_EQ(Gloss{}.Warning({"R"}), "");
}

}  // namespace
}  // namespace nacre::reconstruct::internal

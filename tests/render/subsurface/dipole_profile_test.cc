#include "render/subsurface/dipole_profile.h"

#include "core/error.h"
#include "core/fresnel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace nacre::render {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// The fit to F_dr that the published values were made with [Egan73, Jensen01].
double PolynomialReflectance(double eta) {
  return -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
}

struct Published {
  const char* name;
  double sigma_a;
  double sigma_s_prime;
  double eta;
  std::array<double, 8> rd;  // at kRadii
  double total;
};
constexpr std::array<double, 8> kRadii{0.1, 0.25, 0.5, 1, 2, 3, 5, 8};

const Published kPublished[] = {
    {"marble R",
     0.0021,
     2.19,
     1.5,
     {3.6477e-01,
      2.6632e-01,
      1.2545e-01,
      3.4847e-02,
      9.0938e-03,
      4.1479e-03,
      1.2667e-03,
      3.2666e-04},
     0.83019},
    {"marble B",
     0.0071,
     3,
     1.5,
     {6.4452e-01,
      3.8076e-01,
      1.3566e-01,
      3.3675e-02,
      8.5825e-03,
      3.3800e-03,
      7.6095e-04,
      1.3243e-04},
     0.75261},
    {"skin1 R",
     0.032,
     0.74,
     1.3,
     {4.4035e-02,
      4.2050e-02,
      3.6048e-02,
      2.2019e-02,
      7.2614e-03,
      2.9474e-03,
      8.0183e-04,
      1.8054e-04},
     0.43596},
};

TEST(DipoleProfile, MatchesPublishedProfiles) {
  for (const Published& p : kPublished) {
    const DipoleProfile profile(
        p.sigma_a, p.sigma_s_prime, PolynomialReflectance(p.eta));
    for (std::size_t i = 0; i < kRadii.size(); ++i) {
      EXPECT_NEAR(profile.Rd(kRadii[i]), p.rd[i], 1e-4 * p.rd[i])
          << p.name << " at " << kRadii[i] << " mm";
    }
    EXPECT_NEAR(profile.Total(), p.total, 1e-5) << p.name;
  }
}

TEST(DipoleProfile, FluxWithinIsTheIntegralOfRd) {
  const DipoleProfile profile(0.0041, 2.62, PolynomialReflectance(1.5));
  double sum = 0;
  constexpr double kStep = 1e-3;
  for (int i = 0; i < 3000; ++i) {
    const double r = (i + 0.5) * kStep;
    sum += profile.Rd(r) * 2 * pi * r * kStep;
  }
  EXPECT_NEAR(profile.FluxWithin(3), sum, 1e-5);
  EXPECT_NEAR(profile.FluxWithin(1e6), profile.Total(), 1e-6);
  EXPECT_DOUBLE_EQ(profile.FluxWithin(0), 0);
}

TEST(DipoleProfile, SpreadTermsAreTheEffectOfASpreadSource) {
  const DipoleProfile profile(0.032, 0.74, PolynomialReflectance(1.3));
  constexpr double kVariance = 1e-4;
  const double step = std::sqrt(2 * kVariance);  // four points of this variance
  for (const double in_plane : {0.0, 0.6, 2.0}) {
    for (const double above : {0.0, 1.5}) {
      const double r = std::hypot(in_plane, above);
      const double spread = (profile.Rd(std::hypot(in_plane + step, above)) +
                             profile.Rd(std::hypot(in_plane - step, above)) +
                             2 * profile.Rd(std::hypot(in_plane, step, above))) /
                            4;
      const auto terms = profile.SpreadTerms(r);
      const double expected = spread - profile.Rd(r);
      EXPECT_NEAR(kVariance * (terms.slope + in_plane * in_plane * terms.bend),
                  expected,
                  2e-3 * std::abs(expected))
          << in_plane << " " << above;
    }
  }
}

TEST(DipoleProfile, DiscMeanAveragesOverTheDisc) {
  const DipoleProfile profile(0.0021, 2.19, PolynomialReflectance(1.5));
  for (const double disc : {0.2, 0.7}) {
    for (const double r : {0.0, 0.1, 0.65, 0.7, 0.75, 1.5}) {
      double sum = 0;
      constexpr int kRings = 200;
      constexpr int kAngles = 200;
      for (int i = 0; i < kRings; ++i) {
        const double s = disc * std::sqrt((i + 0.5) / kRings);
        for (int j = 0; j < kAngles; ++j) {
          const double phi = 2 * pi * (j + 0.5) / kAngles;
          sum += profile.Rd(std::hypot(r + s * std::cos(phi), s * std::sin(phi)));
        }
      }
      const double expected = sum / (kRings * kAngles);
      EXPECT_NEAR(profile.DiscMean(r, disc), expected, 1e-3 * expected)
          << "disc " << disc << " at " << r;
    }
  }
}

TEST(DipoleProfile, DiscMeanKeepsTheTotal) {
  const DipoleProfile profile(0.05, 1.0, PolynomialReflectance(1.5));
  for (const double disc : {0.3, 3.0}) {
    double sum = 0;
    constexpr double kStep = 0.01;
    for (int i = 0; i < 5000; ++i) {
      const double r = (i + 0.5) * kStep;
      sum += profile.DiscMean(r, disc) * 2 * pi * r * kStep;
    }
    EXPECT_NEAR(sum, profile.FluxWithin(50), 2e-4) << disc;
  }
}

TEST(DipoleProfile, RejectsNonsense) {
  const auto throws = [](auto&& make, const char* part) {
    EXPECT_THAT(make, ThrowsMessage<Error>(HasSubstr(part)));
  };
  throws([] { DipoleProfile(-1, 1, 0.5); }, "not negative");
  throws([] { DipoleProfile(0, 0, 0.5); }, "one not zero");
  throws([] { DipoleProfile(std::numeric_limits<double>::quiet_NaN(), 1, 0.5); },
         "finite");
  throws([] { DipoleProfile(0.1, 1, 1.0); }, "isn't in [0, 1)");
}

}  // namespace
}  // namespace nacre::render

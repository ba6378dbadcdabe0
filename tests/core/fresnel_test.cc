#include "core/fresnel.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nacre {
namespace {

TEST(Fresnel, NormalIncidenceAndTotalReflection) {
  EXPECT_NEAR(FresnelReflectance(1, 1.5), 0.04, 1e-15);
  EXPECT_NEAR(FresnelReflectance(1, 1 / 1.5), 0.04, 1e-15);
  EXPECT_EQ(FresnelReflectance(0.5, 1 / 1.5), 1);
  EXPECT_EQ(FresnelReflectance(0, 1.5), 1);
  EXPECT_NEAR(FresnelReflectance(0.3, 1), 0, 1e-30);
}

TEST(Fresnel, BrewstersAngleReflectsOnePolarisationOnly) {
  const double cos_brewster = 1 / std::sqrt(1 + 1.5 * 1.5);
  // sin²(θ_i − θ_t) / 2 with θ_i + θ_t = 90°.
  const double expected = 0.5 * std::pow((1 - 1.5 * 1.5) / (1 + 1.5 * 1.5), 2);
  EXPECT_NEAR(FresnelReflectance(cos_brewster, 1.5), expected, 1e-14);
}

// Twice the first Fresnel moment inside a medium, to eight digits, by independent
// quadrature.
TEST(Fresnel, DiffuseReflectanceInsideMatchesTheTable) {
  const double table[][2] = {{1.1, 0.19434492},
                             {1.3, 0.44445670},
                             {1.37, 0.50567255},
                             {1.5, 0.59634576},
                             {2.0, 0.79014916},
                             {2.5, 0.87549865}};
  for (const auto& [eta, expected] : table) {
    EXPECT_NEAR(DiffuseFresnelReflectance(1 / eta), expected, 1e-8) << eta;
  }
  EXPECT_NEAR(DiffuseFresnelReflectance(1.5), 0.09177796, 1e-8);
}

TEST(Fresnel, DiffuseReflectanceKeepsEtendue) {
  for (const double eta : {1.0, 1.2, 1.5, 1.8, 2.4}) {
    EXPECT_NEAR(1 - DiffuseFresnelReflectance(1 / eta),
                (1 - DiffuseFresnelReflectance(eta)) / (eta * eta),
                1e-9)
        << eta;
  }
}

}  // namespace
}  // namespace nacre

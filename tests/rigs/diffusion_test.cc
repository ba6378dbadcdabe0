#include "rigs/transport/dipole.h"
#include "rigs/transport/multipole.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace nacre::rigs {
namespace {

// Egan and Hilgeman's fit of F_dr, with which the values below were computed.
double PolynomialFactor(double eta) {
  const double fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
  return (1 + fdr) / (1 - fdr);
}

constexpr std::array kRadiiMm = {0.1, 0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0};

struct Published {
  const char* name;
  double sigma_a;
  double sigma_s;
  double eta;
  std::array<double, 8> dipole;
  std::array<double, 8> reflected;    // multipole, 10 mm
  std::array<double, 8> transmitted;  // the same
  double dipole_total;
  double reflected_total;
  double transmitted_total;
};

// Quadratures by another program of the formulas in Jensen et al. 2001 and Donner and
// Jensen 2005, five digits each.
const std::array kPublished = {
    Published{"marble_R",
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
              {3.6474e-01,
               2.6629e-01,
               1.2542e-01,
               3.4814e-02,
               9.0620e-03,
               4.1170e-03,
               1.2385e-03,
               3.0388e-04},
              {5.1135e-04,
               5.1074e-04,
               5.0855e-04,
               4.9990e-04,
               4.6723e-04,
               4.1886e-04,
               3.0252e-04,
               1.5348e-04},
              0.83019,
              0.80751,
              0.09747},
    Published{"marble_B",
              0.0071,
              3.0,
              1.5,
              {6.4452e-01,
               3.8076e-01,
               1.3566e-01,
               3.3675e-02,
               8.5825e-03,
               3.3800e-03,
               7.6095e-04,
               1.3243e-04},
              {6.4451e-01,
               3.8076e-01,
               1.3566e-01,
               3.3671e-02,
               8.5786e-03,
               3.3763e-03,
               7.5770e-04,
               1.3008e-04},
              {2.2538e-04,
               2.2505e-04,
               2.2387e-04,
               2.1925e-04,
               2.0192e-04,
               1.7668e-04,
               1.1846e-04,
               5.0985e-05},
              0.75261,
              0.75095,
              0.03256},
    Published{"B_dark",
              0.05,
              1.0,
              1.5,
              {7.8233e-02,
               7.1804e-02,
               5.4655e-02,
               2.5151e-02,
               5.6985e-03,
               1.8816e-03,
               3.9688e-04,
               6.6551e-05},
              {7.8233e-02,
               7.1804e-02,
               5.4655e-02,
               2.5151e-02,
               5.6984e-03,
               1.8815e-03,
               3.9680e-04,
               6.6495e-05},
              {1.2240e-04,
               1.2218e-04,
               1.2138e-04,
               1.1826e-04,
               1.0674e-04,
               9.0464e-05,
               5.5417e-05,
               2.0099e-05},
              0.37068,
              0.37064,
              0.01397},
    Published{"wholemilk_R",
              0.0011,
              2.55,
              1.3,
              {4.9613e-01,
               3.3483e-01,
               1.4414e-01,
               4.1767e-02,
               1.0853e-02,
               4.2764e-03,
               1.0843e-03,
               2.6008e-04},
              {4.9609e-01,
               3.3479e-01,
               1.4410e-01,
               4.1727e-02,
               1.0813e-02,
               4.2382e-03,
               1.0496e-03,
               2.3238e-04},
              {4.5033e-04,
               4.4975e-04,
               4.4770e-04,
               4.3962e-04,
               4.0915e-04,
               3.6425e-04,
               2.5765e-04,
               1.2519e-04},
              0.90770,
              0.87967,
              0.07947},
};
constexpr double kLastDigit = 5.1e-5;  // relative: half a unit of the fifth digit

// ∫ f(r) 2πr dr with r = sinh u, trapezoidal in u.
double OverThePlane(const std::function<double(double)>& f, double outer_mm) {
  constexpr int kSteps = 4000;
  const double end = std::asinh(outer_mm);
  double sum = 0;
  for (int k = 1; k < kSteps; ++k) {
    const double u = end * k / kSteps;
    sum += f(std::sinh(u)) * std::sinh(u) * std::cosh(u);
  }
  return sum * 2 * std::numbers::pi * end / kSteps;
}

TEST(Diffusion, BoundaryFactorIsExact) {
  EXPECT_NEAR(BoundaryFactor(1.0), 1.0, 1e-9);
  EXPECT_NEAR(BoundaryFactor(1.3), 2.600079, 1e-6);
  EXPECT_NEAR(BoundaryFactor(1.5), 3.954736, 1e-6);
  EXPECT_NEAR(BoundaryFactor(2.0), 8.530579, 1e-6);
}

TEST(Diffusion, DipoleGivesThePublishedValues) {
  for (const Published& p : kPublished) {
    const Dipole dipole({p.sigma_a, p.sigma_s}, PolynomialFactor(p.eta));
    for (std::size_t k = 0; k < kRadiiMm.size(); ++k) {
      EXPECT_NEAR(dipole.Reflectance(kRadiiMm[k]) / p.dipole[k], 1, kLastDigit)
          << p.name << " r " << kRadiiMm[k];
    }
    EXPECT_NEAR(dipole.TotalReflectance(), p.dipole_total, 1e-5) << p.name;
  }
}

TEST(Diffusion, DipoleWithTheExactBoundary) {
  EXPECT_NEAR(Dipole({0.0021, 2.19}, BoundaryFactor(1.5)).TotalReflectance(),
              0.830312904768108,
              1e-8);
  EXPECT_NEAR(Dipole({0.05, 1.0}, BoundaryFactor(1.5)).TotalReflectance(),
              0.3707835783663336,
              1e-8);
}

TEST(Diffusion, MultipoleGivesThePublishedValues) {
  for (const Published& p : kPublished) {
    const double factor = PolynomialFactor(p.eta);
    const Multipole slab({p.sigma_a, p.sigma_s}, {10, factor, factor});
    for (std::size_t k = 0; k < kRadiiMm.size(); ++k) {
      EXPECT_NEAR(slab.Reflectance(kRadiiMm[k]) / p.reflected[k], 1, kLastDigit)
          << p.name << " r " << kRadiiMm[k];
      EXPECT_NEAR(slab.Transmittance(kRadiiMm[k]) / p.transmitted[k], 1, kLastDigit)
          << p.name << " r " << kRadiiMm[k];
    }
    EXPECT_NEAR(slab.TotalReflectance(), p.reflected_total, 1e-5) << p.name;
    EXPECT_NEAR(slab.TotalTransmittance(), p.transmitted_total, 1e-5) << p.name;
  }
}

// A thin slab, where the images cancel most: marble_R, 2 mm.
TEST(Diffusion, MultipoleOfAThinSlab) {
  const double factor = PolynomialFactor(1.5);
  const Multipole slab({0.0021, 2.19}, {2, factor, factor});
  EXPECT_NEAR(slab.Reflectance(0.1) / 0.3628673339867516, 1, 1e-9);
  EXPECT_NEAR(slab.Reflectance(3) / 0.0028647535359073305, 1, 1e-8);
  EXPECT_NEAR(slab.Reflectance(5) / 0.0005343448889467199, 1, 1e-7);
  EXPECT_NEAR(slab.Transmittance(0.1) / 0.03364814852488323, 1, 1e-9);
  EXPECT_NEAR(slab.Transmittance(5) / 0.00054180734098415, 1, 1e-7);
}

// The profile, by images near and by modes far, against the closed forms, by images.
TEST(Diffusion, ProfilesIntegrateToTheTotals) {
  for (const bool bottom_reflects_all : {false, true}) {
    for (const double sigma_a : {0.0, 0.01, 0.3}) {
      const Multipole slab({sigma_a, 1.7}, {3, 3.2, 1.0, bottom_reflects_all});
      const double reflected =
          OverThePlane([&](double r) { return slab.Reflectance(r); }, 200);
      const double transmitted =
          OverThePlane([&](double r) { return slab.Transmittance(r); }, 200);
      // A white bottom and no absorption: light spreads without limit and the tail
      // beyond 200 mm is left out.
      const double tolerance = bottom_reflects_all && sigma_a == 0 ? 2e-3 : 1e-6;
      EXPECT_NEAR(reflected, slab.TotalReflectance(), tolerance) << sigma_a;
      EXPECT_NEAR(transmitted, slab.TotalTransmittance(), 1e-6) << sigma_a;
    }
  }
}

TEST(Diffusion, ImagesAndModesMeet) {
  const Multipole slab({0.01, 1.5}, {4, 3.9, 3.9});
  const double half_period_mm = 4 + 2 * 2 * 3.9 / (3 * 1.51);
  const double step_mm = 1e-7;
  const double below = slab.Reflectance(half_period_mm - step_mm);
  const double above = slab.Reflectance(half_period_mm + step_mm);
  EXPECT_NE(below, above);
  EXPECT_NEAR(below / above, 1, 1e-6);
}

TEST(Diffusion, NothingIsLostWithoutAbsorption) {
  const Multipole slab({0, 1.7}, {3, 3.2, 1.4});
  EXPECT_NEAR(slab.TotalReflectance() + slab.TotalTransmittance(), 1, 1e-12);
  // σ_tr → 0 from above must lead to the same.
  const Multipole nearly({1e-9, 1.7}, {3, 3.2, 1.4});
  EXPECT_NEAR(nearly.TotalReflectance(), slab.TotalReflectance(), 1e-6);
  const Multipole on_white({0, 1.7},
                           {.thickness_mm = 3,
                            .top_factor = 3.2,
                            .bottom_factor = 1,
                            .bottom_reflects_all = true});
  EXPECT_NEAR(on_white.TotalReflectance(), 1, 1e-12);
  EXPECT_EQ(on_white.TotalTransmittance(), 0);
}

TEST(Diffusion, AThickSlabIsSemiInfinite) {
  const Dipole dipole({0.05, 1.0}, 3.9);
  for (const bool bottom_reflects_all : {false, true}) {
    const Multipole slab({0.05, 1.0}, {60, 3.9, 3.9, bottom_reflects_all});
    EXPECT_NEAR(slab.TotalReflectance(), dipole.TotalReflectance(), 1e-12);
    EXPECT_NEAR(slab.Reflectance(2) / dipole.Reflectance(2), 1, 1e-9);
  }
}

TEST(Diffusion, AWhiteBottomReturnsWhatABlackOneTakes) {
  const Multipole white({0.01, 1.0}, {4, 3.9, 1, true});
  const Multipole black({0.01, 1.0}, {4, 3.9, 1, false});
  const Multipole air({0.01, 1.0}, {4, 3.9, 3.9, false});
  for (const double r : {0.0, 1.0, 4.0, 12.0}) {
    EXPECT_GT(white.Reflectance(r), air.Reflectance(r)) << r;
    EXPECT_GT(air.Reflectance(r), black.Reflectance(r)) << r;
  }
}

// All lengths times k, all coefficients over k: R_d over k², totals the same.
TEST(Diffusion, ScalingLaw) {
  constexpr double kScale = 3.7;
  const Multipole one({0.02, 1.3}, {5, 3, 2});
  const Multipole other({0.02 / kScale, 1.3 / kScale}, {5 * kScale, 3, 2});
  EXPECT_NEAR(other.TotalReflectance(), one.TotalReflectance(), 1e-12);
  for (const double r : {0.3, 2.0, 20.0}) {
    EXPECT_NEAR(
        other.Reflectance(r * kScale) * kScale * kScale / one.Reflectance(r), 1, 1e-9);
  }
}

}  // namespace
}  // namespace nacre::rigs

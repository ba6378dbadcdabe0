#include "rigs/transport/monte_carlo/monte_carlo.h"
#include "tests/rigs/transport/monte_carlo/reference_totals.h"
#include "tests/rigs/transport/monte_carlo/support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace nacre::rigs::monte_carlo {
namespace {

struct Ring {
  std::size_t index;  // of rings of 0.1 mm
  double per_mm2;
  double se;
};

struct RadialCase {
  const char* name;
  Optics optics;
  double eta;
  std::array<Ring, 8> rings;
};

// Another, independent Monte Carlo (double precision, 2-4e6 photons), itself checked
// against adding-doubling and against MCML ring by ring.
const std::array<RadialCase, 4> kRadialCases{{
    {"dark",
     {0.05, 1, 0},
     1.5,
     {{{0, 7.794128e-01, 2.43e-3},
       {2, 9.602456e-02, 3.72e-4},
       {5, 3.205049e-02, 1.40e-4},
       {10, 1.307381e-02, 6.21e-5},
       {20, 4.531609e-03, 2.43e-5},
       {30, 2.003533e-03, 1.23e-5},
       {50, 4.946537e-04, 4.14e-6},
       {80, 8.304241e-05, 1.08e-6}}}},
    {"marble",
     {0.0021, 2.19, 0},
     1.5,
     {{{0, 1.52201, 4.80e-3},
       {2, 1.875987e-01, 7.59e-4},
       {5, 7.37008e-02, 3.21e-4},
       {10, 3.191099e-02, 1.52e-4},
       {20, 1.041992e-02, 6.20e-5},
       {30, 4.496836e-03, 3.31e-5},
       {50, 1.24143e-03, 1.32e-5},
       {80, 3.11212e-04, 4.95e-6}}}},
    {"skin",
     {0.032, 0.74, 0},
     1.3,
     {{{0, 7.448294e-01, 2.39e-3},
       {2, 1.058528e-01, 3.97e-4},
       {5, 3.665715e-02, 1.54e-4},
       {10, 1.461044e-02, 6.83e-5},
       {20, 5.323802e-03, 2.81e-5},
       {30, 2.588258e-03, 1.53e-5},
       {50, 8.196499e-04, 6.12e-6},
       {80, 1.910337e-04, 2.04e-6}}}},
    {"tissue",
     {0.01, 5, 0.8},
     1.37,
     {{{0, 3.618634e-01, 2.38e-3},
       {2, 7.5714e-02, 4.82e-4},
       {5, 3.787055e-02, 2.28e-4},
       {10, 2.026866e-02, 1.19e-4},
       {20, 8.835834e-03, 5.54e-5},
       {30, 4.350482e-03, 3.12e-5},
       {50, 1.364834e-03, 1.29e-5},
       {80, 3.536619e-04, 4.80e-6}}}},
}};

TEST(Resolved, RingsAgreeWithAnotherProgram) {
  double chi2 = 0;
  for (const RadialCase& c : kRadialCases) {
    const Result r = Simulate(Slab(c.optics, kInf, c.eta),
                              {},
                              {.ring_count = 100, .ring_width_mm = 0.1},
                              Photons(500'000, 5));
    for (const Ring& ring : c.rings) {
      const double z = Deviation(r.ring_per_mm2[ring.index], ring.per_mm2, ring.se);
      EXPECT_LT(std::abs(z), 4) << c.name << " ring " << ring.index;
      chi2 += z * z;
    }
  }
  EXPECT_LT(chi2 / 32, 1.7);
}

// Fraction between two cosines as van de Hulst's function, the bins on both sides of
// mu taken together.
Estimate AtCosine(const std::vector<Estimate>& bins, double mu) {
  const auto count = static_cast<double>(bins.size());
  const auto upper = static_cast<std::size_t>(std::lround(mu * count));
  const double high = (static_cast<double>(upper) + 1) / count;
  const double low = (static_cast<double>(upper) - 1) / count;
  const double width = high * high - low * low;
  return {(bins[upper - 1].mean + bins[upper].mean) / width,
          std::hypot(bins[upper - 1].se, bins[upper].se) / width};
}

// The bins are wide enough for the function's curvature to show.
void ExpectAtCosine(const std::vector<Estimate>& bins, double mu, double expected) {
  const Estimate found = AtCosine(bins, mu);
  EXPECT_NEAR(found.mean, expected, 3.5 * found.se + 0.008 * expected) << mu;
}

// Van de Hulst 1980, table 35.
TEST(Resolved, ExitAnglesAgreeWithVanDeHulst) {
  const Result r = Simulate(
      Slab({0.2, 1.8, 0.75}, 1, 1), {}, {.cosine_count = 50}, Photons(3'000'000));
  const std::array<double, 4> mu{0.3, 0.5, 0.7, 0.9};
  const std::array<double, 4> reflected{.13856, .11956, .09411, .07132};
  const std::array<double, 4> transmitted{.22473, .27785, .36889, .72155};
  for (std::size_t k = 0; k < mu.size(); ++k) {
    ExpectAtCosine(r.reflected_in_cosine, mu[k], reflected[k]);
    ExpectAtCosine(r.transmitted_in_cosine, mu[k], transmitted[k]);
  }
}

// Van de Hulst 1980, table 12: exit at μ = 0.5 of oblique beams.
TEST(Resolved, ExitAnglesOfObliqueBeamsAgreeWithVanDeHulst) {
  const std::array<double, 4> mu0{1.0, 0.7, 0.3, 0.1};
  const std::array<double, 4> reflected{.28616, .34188, .45353, .53214};
  const std::array<double, 4> transmitted{.14864, .13963, .09425, .06601};
  for (std::size_t k = 0; k < mu0.size(); ++k) {
    const Result r = Simulate(Slab({0.2, 0.8, 0}, 2, 1),
                              {.angle_rad = std::acos(mu0[k])},
                              {.cosine_count = 40},
                              Photons(1'000'000, 3));
    ExpectAtCosine(r.reflected_in_cosine, 0.5, reflected[k]);
    // The unscattered beam leaves at μ0, far from 0.5.
    ExpectAtCosine(r.transmitted_in_cosine, 0.5, transmitted[k]);
  }
}

// MCML's figure 6.4, computed by adding-doubling: fluence per incident irradiance.
TEST(Resolved, AbsorptionByDepthIsFluenceTimesSigmaA) {
  constexpr double kStepMm = 0.1;
  const std::array<double, 5> depth_mm{0.5, 1, 2, 5, 10};
  const std::array<double, 5> matched{3.6625, 3.7078, 3.2002, 1.9027, 0.7983};
  const std::array<double, 5> tissue{5.4242, 5.2297, 4.4633, 2.6524, 1.1128};
  for (const double eta : {1.0, 1.37}) {
    const Result r = Simulate(Slab({0.01, 10, 0.9}, kInf, eta),
                              {},
                              {.depth_count = 200, .depth_step_mm = kStepMm},
                              Photons(300'000, 3));
    for (std::size_t k = 0; k < depth_mm.size(); ++k) {
      const auto bin = static_cast<std::size_t>(std::lround(depth_mm[k] / kStepMm));
      const double absorbed =
          r.absorbed_in_depth[bin - 1].mean + r.absorbed_in_depth[bin].mean;
      const double se =
          std::hypot(r.absorbed_in_depth[bin - 1].se, r.absorbed_in_depth[bin].se);
      const double per_fluence = 0.01 * 2 * kStepMm / (1 - r.specular);
      const double expected = eta == 1 ? matched[k] : tissue[k];
      EXPECT_NEAR(absorbed, expected * per_fluence, 3.5 * se + 1e-3 * absorbed)
          << eta << " at " << depth_mm[k];
    }
  }
}

TEST(Resolved, WindowAndRingsCountTheSameLight) {
  const TallyRequest request{.window_centre = {0.3, -0.2},
                             .window_core = 401,
                             .window_pitch_mm = 1,
                             .ring_count = 1,
                             .ring_width_mm = 200};
  const Source source{.centre = {0.3, -0.2}};
  const Result r =
      Simulate(Slab({0.05, 1, 0}, kInf, 1.5), source, request, Photons(200'000));
  double sum = 0;
  for (const Estimate& cell : r.window_per_mm2) {
    sum += cell.mean;
  }
  EXPECT_NEAR(sum, r.reflected.mean, 1e-9);
  EXPECT_NEAR(
      r.ring_per_mm2[0].mean * 3.14159265358979 * 200 * 200, r.reflected.mean, 1e-9);
}

// Row 0 of a window is its top, column 0 its left.
TEST(Resolved, WindowRunsAsAPicture) {
  const TallyRequest request{.window_core = 3, .window_pitch_mm = 1};
  const Volume volume = Slab({5, 5, 0}, kInf, 1);  // leaves within 0.1 mm
  const auto brightest = [&](PointMm centre) {
    const Result r = Simulate(volume, {.centre = centre}, request, Photons(20'000));
    const auto& w = r.window_per_mm2;
    return std::max_element(
               w.begin(),
               w.end(),
               [](const auto& a, const auto& b) { return a.mean < b.mean; }) -
           w.begin();
  };
  EXPECT_EQ(brightest({0, 0}), 4);
  EXPECT_EQ(brightest({-1, 1}), 0);
  EXPECT_EQ(brightest({1, 1}), 2);
  EXPECT_EQ(brightest({-1, -1}), 6);
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

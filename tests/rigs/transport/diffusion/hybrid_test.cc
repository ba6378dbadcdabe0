// The diffusion solver with Monte Carlo profiles of its media, as it is by default.
#include "core/error.h"
#include "rigs/transport/analytic/robin_slab.h"
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/diffusion/monte_carlo_profile.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace nacre::rigs::diffusion {
namespace {

// Ring means 0.1 mm wide of an independent program (physics-reference.md, section 8).
TEST(MonteCarloProfile, IsTheIndependentOne) {
  const Phantom marble = ParsePhantom(
      "[slab]\nthickness_mm = inf\neta = 1.5\n"
      "[[medium]]\nsigma_a_per_mm = 0.0021\nsigma_s_per_mm = 2.19\n",
      "test");
  const DiffusionMedium medium{0.0021, 2.19};
  const double a = BoundaryFactor(BoundaryLaw::kExact, 1.5);
  const RobinSlab model({.medium = medium,
                         .diffusion_mm = DiffusionMm(DiffusionLaw::kGrosjean, medium),
                         .thickness_mm = std::numeric_limits<double>::infinity(),
                         .top_factor = a,
                         .bottom_factor = 1});
  const auto profile =
      MonteCarloProfile(marble, {.last_mm = 12, .photon_count = 1'500'000}, model);
  struct Ring {
    double from_mm;
    double mean;
  };
  for (const Ring ring : {Ring{0.2, 1.8760e-1},
                          Ring{0.5, 7.3701e-2},
                          Ring{1, 3.1911e-2},
                          Ring{2, 1.0420e-2},
                          Ring{3, 4.4968e-3},
                          Ring{5, 1.2414e-3},
                          Ring{8, 3.1121e-4}}) {
    double mean = 0;
    for (int k = 0; k < 10; ++k) {
      const double r = ring.from_mm + 0.01 * (k + 0.5);
      mean += profile(r) * 0.1 * r / (ring.from_mm + 0.05);
    }
    // Their noise (1.6 % at 8 mm) and ours.
    EXPECT_NEAR(mean / ring.mean, 1, ring.from_mm > 6 ? 0.04 : 0.02) << ring.from_mm;
  }
}

TEST(MonteCarloProfile, RefusesWhatNeverEnds) {
  const Phantom phantom = ParsePhantom(
      "[slab]\nthickness_mm = inf\neta = 1.3\n[[medium]]\nname = \"snow\"\n"
      "sigma_a_per_mm = 0.0\nsigma_s_per_mm = 1.0\n",
      "test");
  try {
    const DiffusionTransport transport(phantom);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("'snow' doesn't absorb"));
    EXPECT_THAT(e.what(), testing::HasSubstr("reference_photons = 0"));
  }
}

// Means over rings around the beam, beyond a free path, against Monte Carlo of the
// whole chessboard. README.md has more positions and media.
TEST(Hybrid, ChessboardIsWithinThreePercentOfMonteCarlo) {
  const Phantom phantom = ParsePhantom(
      "[slab]\nthickness_mm = 10\neta = 1.3\n"
      "[[medium]]\nsigma_a_per_mm = 0.002\nsigma_s_per_mm = 2.5\n"
      "[[medium]]\nsigma_a_per_mm = 0.02\nsigma_s_per_mm = 2.0\n"
      "[pattern]\ntype = \"chessboard\"\ncell_mm = 4\n"
      "[grid]\npoints = [64, 64]\npitch_mm = 0.4\ncore = 21\n",
      "test");
  const DiffusionTransport hybrid(phantom, {.reference_photons = 1'000'000});
  const double free_path_mm = 0.5;
  for (const PointMm x_i : {PointMm{2, 2}, PointMm{3.4, 1.8}}) {
    const Window found = hybrid.WindowAround(x_i);
    const auto truth = monte_carlo::Simulate(monte_carlo::MakeVolume(phantom, 0),
                                             monte_carlo::Source{.centre = x_i},
                                             {.window_centre = x_i,
                                              .window_core = 21,
                                              .window_pitch_mm = 0.4,
                                              .use_symmetry = true},
                                             {.photon_count = 1'500'000, .seed = 77});
    constexpr std::array kEdges = {1.0, 1.7, 3.0, 5.0, 8.0};
    for (std::size_t e = 0; e + 1 < kEdges.size(); ++e) {
      double light = 0;
      double expected = 0;
      for (std::size_t k = 0; k < found.rd.size(); ++k) {
        const double dx = static_cast<double>(k % 21) - 10;
        const double dy = static_cast<double>(k / 21) - 10;
        const double r = 0.4 * std::hypot(dx, dy) / free_path_mm;
        if (r >= kEdges[e] && r < kEdges[e + 1]) {
          light += static_cast<double>(found.rd[k]);
          expected += truth.window_per_mm2[k].mean;
        }
      }
      EXPECT_NEAR(light / expected, 1, 0.03) << x_i.x << ' ' << kEdges[e];
    }
  }
}

}  // namespace
}  // namespace nacre::rigs::diffusion

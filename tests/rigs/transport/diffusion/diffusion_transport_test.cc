#include "rigs/transport/diffusion/diffusion_transport.h"

#include "core/error.h"
#include "rigs/pattern_mixture.h"
#include "rigs/transport/analytic/robin_slab.h"
#include "rigs/transport/diffusion/distinct_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace nacre::rigs {
namespace {

Phantom Make(const std::string& pattern,
             const std::string& slab = "thickness_mm = 10\neta = 1.5",
             const std::string& rest = "") {
  std::string text = "[slab]\n" + slab +
                     "\n[[medium]]\nsigma_a_per_mm = 0.0021\nsigma_s_per_mm = 2.19\n";
  if (pattern != "homogeneous") {
    text += "[[medium]]\nsigma_a_per_mm = 0.01\nsigma_s_per_mm = 1.2\n";
  }
  text += "[pattern]\ntype = \"" + pattern + "\"\n" +
          (pattern == "homogeneous" ? "" : "cell_mm = 3\n") +
          "[grid]\npoints = [12, 12]\npitch_mm = 0.5\ncore = 15\n" + rest;
  return ParsePhantom(text, "test");
}

// Diffusion's own reference: quick, and what analytic solutions are for.
DiffusionOptions Pure() {
  DiffusionOptions options;
  options.reference_photons = 0;
  return options;
}

float At(const Window& window, int core, int dx, int dy) {
  const int half = (core - 1) / 2;
  return window.rd[static_cast<std::size_t>((half - dy) * core + half + dx)];
}

TEST(DiffusionTransport, HomogeneousIsTheExactSolution) {
  const Phantom phantom = Make("homogeneous");
  const DiffusionTransport transport(phantom, Pure());
  const Window window = transport.WindowAround(phantom.grid.Point(3, 4));
  const DiffusionMedium medium{0.0021, 2.19};
  const double a = BoundaryFactor(BoundaryLaw::kExact, 1.5);
  const RobinSlab exact({.medium = medium,
                         .diffusion_mm = DiffusionMm(DiffusionLaw::kGrosjean, medium),
                         .thickness_mm = 10,
                         .top_factor = a,
                         .bottom_factor = a});
  // Cells far from the beam are nearly their centre's value.
  for (const int d : {4, 5, 6, 7}) {
    const double expected = exact.Reflectance(0.5 * d);
    EXPECT_NEAR(static_cast<double>(At(window, 15, d, 0)) / expected, 1, 0.02) << d;
    EXPECT_NEAR(static_cast<double>(At(window, 15, 0, -d)) / expected, 1, 0.02) << d;
  }
}

// What the default mesh costs beside one three times as fine: 0.6 % rms, most where a
// border passes close by the beam.
TEST(DiffusionTransport, MeshIsFineEnoughByDefault) {
  const Phantom chess = Make("chessboard");
  DiffusionOptions fine = Pure();
  fine.step_free_paths = 0.5;
  fine.first_layer_free_paths = 0.13;
  fine.layer_growth = 1.2;
  const DiffusionTransport normal(chess, Pure());
  const DiffusionTransport finer(chess, fine);
  const PointMm x_i = chess.grid.Point(4, 7);  // 0.75 mm from a border
  const Window a = normal.WindowAround(x_i);
  const Window b = finer.WindowAround(x_i);
  double squares = 0;
  double worst = 0;
  double worst_far = 0;
  for (int dy = -7; dy <= 7; ++dy) {
    for (int dx = -7; dx <= 7; ++dx) {
      const double error = std::abs(static_cast<double>(At(a, 15, dx, dy)) /
                                        static_cast<double>(At(b, 15, dx, dy)) -
                                    1);
      squares += error * error / (15 * 15);
      worst = std::max(worst, error);
      worst_far = std::hypot(dx, dy) > 2.5 ? std::max(worst_far, error) : worst_far;
    }
  }
  EXPECT_LT(std::sqrt(squares), 0.01);
  EXPECT_LT(worst, 0.03);
  EXPECT_LT(worst_far, 0.02);
}

TEST(DiffusionTransport, TotalsAreTheExactSlabs) {
  const Phantom phantom =
      Make("homogeneous", "thickness_mm = 4\neta = 1.3\nbottom = \"matched\"");
  DiffusionOptions options = Pure();
  options.margin_decays = 6;
  options.first_layer_free_paths = 0.05;
  options.layer_growth = 1.1;
  const DiffusionTransport transport(phantom, options);
  const DiffusionMedium medium{0.0021, 2.19};
  const RobinSlab exact({.medium = medium,
                         .diffusion_mm = DiffusionMm(DiffusionLaw::kGrosjean, medium),
                         .thickness_mm = 4,
                         .top_factor = BoundaryFactor(BoundaryLaw::kExact, 1.3),
                         .bottom_factor = 1});
  const Totals totals = transport.TotalsAt({0.1, 0.2}, 0);
  EXPECT_NEAR(totals.reflected, exact.TotalReflectance(), 3e-3);
  EXPECT_NEAR(totals.transmitted, exact.TotalTransmittance(), 3e-3);
  EXPECT_NEAR(totals.reflected + totals.transmitted + totals.absorbed, 1, 1e-12);
}

TEST(DiffusionTransport, WhiteBottomLetsNothingThrough) {
  const Phantom phantom =
      Make("chessboard", "thickness_mm = 2\neta = 1.3\nbottom = \"white\"");
  const DiffusionTransport white(phantom, Pure());
  const DiffusionTransport air(Make("chessboard", "thickness_mm = 2\neta = 1.3"),
                               Pure());
  EXPECT_EQ(white.TotalsAt({1, 1}, 0).transmitted, 0);
  EXPECT_GT(white.TotalsAt({1, 1}, 0).reflected,
            air.TotalsAt({1, 1}, 0).reflected + 0.1);
}

TEST(DiffusionTransport, BlackBottomCountsAsAbsorbed) {
  const DiffusionTransport black(
      Make("homogeneous", "thickness_mm = 2\neta = 1.3\nbottom = \"black\""), Pure());
  const DiffusionTransport matched(
      Make("homogeneous", "thickness_mm = 2\neta = 1.3\nbottom = \"matched\""), Pure());
  const Totals b = black.TotalsAt({0, 0}, 0);
  const Totals m = matched.TotalsAt({0, 0}, 0);
  EXPECT_EQ(b.transmitted, 0);
  EXPECT_NEAR(b.reflected, m.reflected, 1e-9);
  EXPECT_NEAR(b.absorbed, m.absorbed + m.transmitted, 1e-9);
}

// What is cut off is what flows on there: it falls as the slab's slowest mode does.
TEST(DiffusionTransport, TruncationFallsExponentiallyWithTheMargin) {
  const Phantom phantom = Make("chessboard");
  const auto lost = [&](double decays) {
    DiffusionOptions options = Pure();
    options.margin_decays = decays;
    return DiffusionTransport(phantom, options).TruncatedAt({0, 0}, 0);
  };
  const double after_six = lost(6);
  EXPECT_LT(after_six, 1e-3);
  EXPECT_NEAR(std::log(lost(2) / after_six), 4, 0.4);
}

TEST(DiffusionTransport, ReciprocalExitIsSymmetric) {
  DiffusionOptions options = Pure();
  options.reciprocal_exit = true;
  options.tolerance = 1e-7;
  const Phantom phantom = Make("chessboard");
  const DiffusionTransport transport(phantom, options);
  DiffusionOptions flux = options;
  flux.reciprocal_exit = false;
  const DiffusionTransport ordinary(phantom, flux);
  // Columns of one tile, so that both see the same mesh: (4, 4) and (7, 7), with a
  // border in between. The near-field factor depends on the pair alone.
  const PointMm a = phantom.grid.Point(4, 4);
  const PointMm b = phantom.grid.Point(7, 7);
  const auto ratio = [&](const DiffusionTransport& t) {
    return static_cast<double>(At(t.WindowAround(a), 15, 3, -3)) /
           static_cast<double>(At(t.WindowAround(b), 15, -3, 3));
  };
  EXPECT_NEAR(ratio(transport), 1, 1e-5);
  // Normal incidence in, all directions out isn't: the two media differ.
  const PointMm in_first = phantom.grid.Point(4, 5);
  const PointMm in_second = phantom.grid.Point(7, 5);
  const double asymmetry =
      static_cast<double>(At(ordinary.WindowAround(in_first), 15, 3, 0)) /
      static_cast<double>(At(ordinary.WindowAround(in_second), 15, -3, 0));
  EXPECT_GT(std::abs(asymmetry - 1), 0.005);
  EXPECT_LT(std::abs(asymmetry - 1), 0.5);
}

// A beam on a border belongs to both sides: the picture is the mirrored one, media
// exchanged.
TEST(DiffusionTransport, BeamOnABorderIsSharedByBothMedia) {
  const Phantom phantom = Make("chessboard");
  Phantom exchanged = phantom;
  std::swap(exchanged.media[0], exchanged.media[1]);
  const Window a = DiffusionTransport(phantom, Pure()).WindowAround({0, 1.5});
  const Window b = DiffusionTransport(exchanged, Pure()).WindowAround({0, 1.5});
  for (int dy = -7; dy <= 7; ++dy) {
    for (int dx = -7; dx <= 7; ++dx) {
      EXPECT_NEAR(At(a, 15, dx, dy) / At(b, 15, -dx, dy), 1, 2e-3) << dx << ' ' << dy;
    }
  }
}

TEST(DiffusionTransport, ThreadsDoNotMatter) {
  const Phantom phantom = Make("chessboard");
  std::vector<PointMm> points;
  for (int k = 0; k < 40; ++k) {
    points.push_back(phantom.grid.Point(k % 12, k / 4));
  }
  std::vector<std::vector<Window>> results;
  for (const int threads : {1, 2, 3}) {
    DiffusionOptions options = Pure();
    options.thread_count = threads;
    const DiffusionTransport transport(phantom, options);
    std::vector<Window>& windows = results.emplace_back(points.size());
    transport.SolveWindows(points, [&](std::size_t k, Window&& window) {
      windows[k] = std::move(window);
    });
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_EQ(results[0][k].rd, results[1][k].rd);
    EXPECT_EQ(results[0][k].rd, results[2][k].rd);
  }
}

TEST(DiffusionTransport, ExitanceAtPointsAgreesWithTheWindow) {
  const Phantom phantom = Make("chessboard");
  const DiffusionTransport transport(phantom, Pure());
  const PointMm x_i = phantom.grid.Point(4, 7);
  const Window window = transport.WindowAround(x_i);
  for (const int d : {-6, -3, 3, 5}) {
    const float x = static_cast<float>(x_i.x + 0.5 * d);
    const float y = static_cast<float>(x_i.y);
    float exitance = 1;
    transport.AddExitance(x_i, 0, 2, {&x, &y, 1}, &exitance);
    const double expected = static_cast<double>(At(window, 15, d, 0));
    EXPECT_NEAR((static_cast<double>(exitance) - 1) / 2 / expected, 1, 0.06) << d;
  }
}

TEST(DiffusionTransport, GivenReferenceIsReproduced) {
  const Phantom phantom = Make("homogeneous");
  const auto profile = [](std::size_t, std::size_t, double r_mm) {
    return 0.3 * std::exp(-r_mm) / (r_mm + 0.1);
  };
  const DiffusionTransport transport(phantom, Pure(), profile);
  const Window window = transport.WindowAround({0.25, 0.25});
  EXPECT_NEAR(static_cast<double>(At(window, 15, 6, 0)) / profile(0, 0, 3.0), 1, 0.02);
}

TEST(DiffusionTransport, WideBeamIsAMeanOfPencils) {
  const Phantom wide = Make("homogeneous",
                            "thickness_mm = 10\neta = 1.5",
                            "[beam]\nshape = \"square\"\nwidth_mm = 1.5\n");
  const Phantom pencil = Make("homogeneous");
  const Window w = DiffusionTransport(wide, Pure()).WindowAround({0.25, 0.25});
  const Window p = DiffusionTransport(pencil, Pure()).WindowAround({0.25, 0.25});
  double mean = 0;
  for (int b = -1; b <= 1; ++b) {
    for (int a = -1; a <= 1; ++a) {
      mean += static_cast<double>(At(p, 15, 4 - a, -b)) / 9;
    }
  }
  // Windows and the near field are solved on meshes with different margins.
  EXPECT_NEAR(static_cast<double>(At(w, 15, 4, 0)) / mean, 1, 2e-4);
}

TEST(DiffusionTransport, InfiniteSlabAndAbsorptionFreeMediaWork) {
  const Phantom phantom = ParsePhantom(
      "[slab]\nthickness_mm = inf\neta = 1.3\n[[medium]]\nsigma_a_per_mm = 0.0\n"
      "sigma_s_per_mm = 1.0\n[grid]\npoints = [4, 4]\npitch_mm = 0.5\ncore = 9\n",
      "test");
  const DiffusionTransport transport(phantom, Pure());
  const Totals totals = transport.TotalsAt({0, 0}, 0);
  EXPECT_GT(totals.reflected, 0.9);
  EXPECT_EQ(totals.transmitted, 0);
  EXPECT_NEAR(totals.reflected + transport.TruncatedAt({0, 0}, 0), 1, 1e-6);
}

// Half of each everywhere is a medium of its own.
TEST(DiffusionTransport, EvenMixtureIsAMedium) {
  Phantom mixed = Make("chessboard");
  mixed.pattern = {.type = PatternType::kMixture,
                   .mixture = std::make_shared<MixtureMap>(
                       MixtureMap::Layout{.count_x = 1, .count_y = 1, .cell_mm = 1},
                       std::vector<float>{0.5F})};
  Phantom alone = Make("homogeneous");
  alone.media.front().sigma_a_per_mm = {0.5 * (0.0021 + 0.01)};
  alone.media.front().sigma_s_per_mm = {0.5 * (2.19 + 1.2)};
  const Window m = DiffusionTransport(mixed, Pure()).WindowAround({0.25, 0.25});
  const Window a = DiffusionTransport(alone, Pure()).WindowAround({0.25, 0.25});
  for (const int d : {3, 5, 7}) {
    EXPECT_NEAR(At(m, 15, d, 0) / At(a, 15, d, 0), 1, 0.02) << d;
  }
}

TEST(DiffusionTransport, RefusesLayers) {
  Phantom phantom = Make("homogeneous");
  phantom.layers = {{1, 1.5, 0}, {9, 1.5, 0}};
  try {
    const DiffusionTransport transport(phantom, Pure());
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("the diffusion solver"));
  }
}

TEST(DiffusionTransport, RefusesObliqueBeams) {
  const Phantom phantom =
      Make("homogeneous", "thickness_mm = 10\neta = 1.5", "[beam]\nangle_deg = 10\n");
  try {
    const DiffusionTransport transport(phantom, Pure());
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("angle_deg"));
  }
}

TEST(DiffusionTransport, RefusesEmptyMedia) {
  const Phantom phantom = ParsePhantom(
      "[slab]\nthickness_mm = 3\neta = 1.3\n[[medium]]\nname = \"void\"\n"
      "sigma_a_per_mm = 0.0\nsigma_s_per_mm = 0.0\n",
      "test");
  try {
    const DiffusionTransport transport(phantom, Pure());
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("'void' neither scatters nor absorbs"));
  }
}

}  // namespace
}  // namespace nacre::rigs

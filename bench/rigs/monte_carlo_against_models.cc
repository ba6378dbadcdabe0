// Errors of the fast model and of diffusion against Monte Carlo, by medium, pattern,
// pitch and thickness: what solver_choice.cc states is read off here.
//   monte_carlo_against_models [photons]
// Of windows: Σ |error| / Σ value over 15 × 15 cells, less what the noise makes of it;
// of totals: the larger relative error of R and T (relative to 0.01 where they are
// less). "-": the solver refuses.
#include "core/error.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "rigs/transport/transport.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace nacre::rigs {
namespace {

struct Case {
  std::string name;
  std::vector<Medium> media;
  double cell_mm = 0;  // 0: homogeneous
  double eta = 1.5;
};

std::vector<Case> Cases() {
  const Medium marble{"marble", {0.0021}, {2.19}, {0}};
  const Medium grey{"grey", {0.01}, {1.5}, {0}};
  const Medium dark{"dark", {0.05}, {1.0}, {0}};
  const Medium tissue{"tissue", {0.01}, {5}, {0.8}};
  const Medium black{"black", {0.2}, {1.0}, {0}};
  return {{"marble", {marble}},
          {"tissue, g 0.8", {tissue}, 0, 1.37},
          {"dark", {dark}},
          {"black", {black}},
          {"marble, grey 1.5 mm", {marble, grey}, 1.5},
          {"marble, grey 6 mm", {marble, grey}, 6},
          {"marble, dark 1.5 mm", {marble, dark}, 1.5},
          {"marble, dark 6 mm", {marble, dark}, 6}};
}

double LongestFreePathMm(const Case& c) {
  double longest = 0;
  for (const Medium& m : c.media) {
    longest = std::max(longest, 1 / (m.sigma_a_per_mm[0] + m.ReducedScattering(0)));
  }
  return longest;
}

Phantom MakePhantom(const Case& c, double pitch_mm, double thickness_mm) {
  Phantom phantom;
  phantom.channels = {"Y"};
  phantom.slab = {.thickness_mm = thickness_mm, .eta = c.eta, .bottom = Bottom::kAir};
  phantom.media = c.media;
  if (c.cell_mm > 0) {
    phantom.pattern = {.type = PatternType::kChessboard, .cell_mm = c.cell_mm};
  }
  phantom.grid.points_x = 16;
  phantom.grid.points_y = 16;
  phantom.grid.pitch_mm = pitch_mm;
  phantom.grid.core = 15;
  return phantom;
}

// Where the beam meets the pattern matters: the middle of a cell, beside a border.
std::vector<PointMm> Places(const Case& c) {
  if (c.cell_mm == 0) {
    return {{0, 0}};
  }
  return {{0.5 * c.cell_mm, 0.5 * c.cell_mm},
          {1.5 * c.cell_mm, 0.5 * c.cell_mm},
          {0.9 * c.cell_mm, 0.4 * c.cell_mm}};
}

double WindowError(const Window& window, const monte_carlo::Result& truth) {
  double error = 0;
  double noise = 0;
  double sum = 0;
  for (std::size_t k = 0; k < window.rd.size(); ++k) {
    const monte_carlo::Estimate& cell = truth.window_per_mm2[k];
    error += std::abs(static_cast<double>(window.rd[k]) - cell.mean);
    noise += cell.se;
    sum += cell.mean;
  }
  noise *= std::sqrt(2 / std::numbers::pi);
  return std::max(0.0, error * error - noise * noise) / (error * sum);
}

double TotalsError(const Totals& totals, const monte_carlo::Result& truth) {
  const auto relative = [](double value, double expected) {
    return std::abs(value - expected) / std::max(expected, 0.01);
  };
  return std::max(relative(totals.reflected, truth.reflected.mean),
                  relative(totals.transmitted, truth.transmitted.mean));
}

struct Model {
  Solver solver;
  bool near_field;
};

struct Worst {
  double window = 0;
  double totals = 0;
};

Worst Compare(const Phantom& phantom,
              const Model& model,
              const std::vector<PointMm>& places,
              const std::vector<monte_carlo::Result>& truths) {
  Worst worst;
  const auto transport =
      MakeTransport(phantom, model.solver, {.near_field = model.near_field});
  for (std::size_t k = 0; k < places.size(); ++k) {
    worst.window = std::max(worst.window,
                            WindowError(transport->WindowAround(places[k]), truths[k]));
    worst.totals = std::max(worst.totals,
                            TotalsError(transport->TotalsAt(places[k], 0), truths[k]));
  }
  return worst;
}

void Run(const Case& c, double thickness_mm, std::int64_t photons) {
  const double free_path_mm = LongestFreePathMm(c);
  for (const double pitch : {0.5, 2.0, 5.0}) {
    const Phantom phantom = MakePhantom(c, pitch * free_path_mm, thickness_mm);
    const monte_carlo::MonteCarloTransport exact(phantom, {.photon_count = photons});
    const std::vector<PointMm> places = Places(c);
    std::vector<monte_carlo::Result> truths;
    for (const PointMm x_i : places) {
      truths.push_back(exact.Simulate(x_i,
                                      0,
                                      {.window_centre = x_i,
                                       .window_core = phantom.grid.core,
                                       .window_pitch_mm = phantom.grid.pitch_mm,
                                       .use_symmetry = true}));
    }
    fmt::print("| {} | {:.1f} | {:.1f} |", c.name, thickness_mm / free_path_mm, pitch);
    for (const Model& model : {Model{Solver::kFast, false},
                               Model{Solver::kDiffusion, false},
                               Model{Solver::kDiffusion, true}}) {
      try {
        const Worst worst = Compare(phantom, model, places, truths);
        fmt::print(" {:.1f} % | {:.1f} % |", 100 * worst.window, 100 * worst.totals);
      } catch (const Error& error) {
        fmt::print(" - | - |");
      }
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace nacre::rigs

int main(int argc, char** argv) {
  const std::int64_t photons = argc > 1 ? std::atoll(argv[1]) : 300'000;
  fmt::print(
      "| media | thickness, free paths | pitch, free paths | fast: window | totals | "
      "diffusion, no near field: window | totals | diffusion: window | totals "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& c : nacre::rigs::Cases()) {
    for (const double thickness_mm : {4.0, 10.0}) {
      nacre::rigs::Run(c, thickness_mm, photons);
    }
  }
  return 0;
}

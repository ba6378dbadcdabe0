#pragma once

#include "core/options.h"

#include <cstdint>

namespace nacre {
class Ranks;
}

namespace nacre::rigs {

struct DiffusionOptions {
  double step_free_paths = 1.5;
  double margin_decays = 2.0;
  double first_layer_free_paths = 0.2;
  double layer_growth = 1.25;
  double tolerance = 1e-6;
  std::int64_t reference_photons = 4'000'000;
  std::int64_t reference_seed = 1;
  bool classical_coefficient = false;
  bool reciprocal_exit = false;
  int thread_count = 0;
  const Ranks* ranks = nullptr;  ///< see Transport

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("step_free_paths",
          self.step_free_paths,
          Range{0.05, 10},
          "widest column, in the shortest transport mean free path");
    visit("margin_decays",
          self.margin_decays,
          Range{0.1, 20},
          "simulated beyond the window, in the slab's lateral decay lengths");
    visit("first_layer_free_paths",
          self.first_layer_free_paths,
          Range{0.01, 2},
          "thickness of the first layer");
    visit("layer_growth", self.layer_growth, Range{1, 2}, "of a layer to the next");
    visit("tolerance", self.tolerance, Range{1e-12, 0.1}, "relative residual");
    visit("reference_photons",
          self.reference_photons,
          Range{0, 1e12},
          "for the Monte Carlo profile of each medium and channel; 0: pure diffusion");
    visit("reference_seed", self.reference_seed, Range{0}, "of those photons");
    visit("classical_coefficient",
          self.classical_coefficient,
          Range{},
          "D = 1 / (3 sigma_t') instead of Grosjean's");
    visit("reciprocal_exit",
          self.reciprocal_exit,
          Range{},
          "light leaves as it enters: exactly symmetric in x_i and x_o");
    visit("thread_count", self.thread_count, Range{0}, "0: all cores");
  }
};

}  // namespace nacre::rigs

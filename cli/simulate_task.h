#pragma once

// What all of `nacre simulate`'s results share: the arguments, the choice of the solver
// and what is said of it.

#include "cli/command_line.h"
#include "core/json.h"
#include "core/provenance.h"
#include "rigs/transport/solver_choice.h"

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::cli {

struct SimulateArguments {
  std::filesystem::path phantom;
  std::filesystem::path out;
  std::string solver = "auto";
  std::vector<double> beam_mm;
  std::filesystem::path photo;
  bool totals = false;
  rigs::SolverOptions options;
  int cosine_count = 0;
  int depth_count = 0;
  double depth_step_mm = 0;
};

struct SimulateTask {
  const SimulateArguments& args;
  const Common& common;
  rigs::Phantom phantom;
  rigs::SolverOptions options;
  Provenance provenance;
  double cpu_start = 0;

  rigs::PointMm Beam() const {
    return args.beam_mm.empty() ? rigs::PointMm{}
                                : rigs::PointMm{args.beam_mm[0], args.beam_mm[1]};
  }
};

/// The solver that was asked for, or the one that "auto" stands for, which is said.
rigs::Selection SelectFor(SimulateTask& task, rigs::Quantity quantity);

/// What every result's JSON says of how it came about.
Json About(const SimulateTask& task, const rigs::Selection& selection);

/// The flux that leaves within the window and the noise it is known to, a channel.
struct WindowFigures {
  Json flux = Json::array();
  Json noise = Json::array();
  double worst_noise = 0;
};

WindowFigures FiguresOf(const rigs::Phantom& phantom, const rigs::Window& window);

/// Says so if the noise is more than the error that was wanted.
void SayIfMissed(const SimulateTask& task, double noise);

/// null stands for "not known".
Json NumberOrNull(double value);

}  // namespace nacre::cli

#include "cli/simulate_task.h"

#include "cli/stage_clock.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::cli {

rigs::Selection SelectFor(SimulateTask& task, rigs::Quantity quantity) {
  using rigs::Solver;
  const Solver wanted = rigs::ParseSolver(task.args.solver);
  const ProgressFunction progress = ConsoleProgress(task.common);
  rigs::Selection selection;
  if (wanted == Solver::kAuto) {
    selection = rigs::SelectSolver(task.phantom, task.options, quantity, progress);
    Say(task.common,
        fmt::format(
            "auto: solver {} ({})", rigs::Name(selection.solver), selection.why));
  } else {
    selection.solver = wanted;
    selection.why = "as asked for";
    selection.stated_error = rigs::StatedError(task.phantom, wanted, quantity);
    selection.transport =
        rigs::MakeTransport(task.phantom, wanted, task.options, progress);
    if (!(selection.stated_error <= task.options.error) && task.options.error > 0) {
      Say(task.common,
          fmt::format(
              "note: {}'s stated error for this phantom is {:.2g}, more than the "
              "{:g} wanted; --solver auto finds one that meets it",
              task.args.solver,
              selection.stated_error,
              task.options.error));
    }
  }
  task.provenance.options["solver"] = rigs::Name(selection.solver);
  return selection;
}

Json NumberOrNull(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json About(const SimulateTask& task, const rigs::Selection& selection) {
  return {{"solver", rigs::Name(selection.solver)},
          {"why", selection.why},
          {"stated_error", NumberOrNull(selection.stated_error)},
          {"seed", task.options.seed},
          {"cpu_seconds", CpuSeconds() - task.cpu_start}};
}

WindowFigures FiguresOf(const rigs::Phantom& phantom, const rigs::Window& window) {
  const double cell_mm2 = phantom.grid.pitch_mm * phantom.grid.pitch_mm;
  const std::size_t cells = window.rd.size() / phantom.channels.size();
  WindowFigures figures;
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    double sum = 0;
    double sigma = 0;
    for (std::size_t k = c * cells; k < (c + 1) * cells; ++k) {
      sum += static_cast<double>(window.rd[k]);
      sigma += static_cast<double>(window.sigma[k]);
    }
    const double noise = sigma > 0 ? std::sqrt(2 / std::numbers::pi) * sigma / sum : 0;
    figures.flux.push_back(sum * cell_mm2);
    figures.noise.push_back(NumberOrNull(noise));
    figures.worst_noise = std::max(figures.worst_noise, noise);
  }
  return figures;
}

void SayIfMissed(const SimulateTask& task, double noise) {
  if (task.options.error > 0 && noise > task.options.error) {
    Say(task.common,
        fmt::format("note: the noise is {:.2g}, more than the {:g} wanted; allow more "
                    "--photons",
                    noise,
                    task.options.error));
  }
}

}  // namespace nacre::cli

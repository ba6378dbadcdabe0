// nacre simulate: R_d of a phantom by a model of light transport.

#include "cli/command_line.h"
#include "cli/simulate_task.h"
#include "cli/stage_clock.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/options_json.h"
#include "reconstruct/rd_dataset.h"
#include "rigs/photo.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "rigs/transport/solve_grid.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace nacre::cli {
namespace {

using reconstruct::RdHeader;
using reconstruct::RdSlice;
using reconstruct::RdWriter;
using rigs::Phantom;
using rigs::Quantity;
using rigs::Selection;
using rigs::Solver;

using Task = SimulateTask;

void RequireGrid(const Task& task) {
  if (task.phantom.grid.points_x == 0) {
    throw BadData(task.args.phantom.string() +
                  ": no [grid], which says where R_d is wanted");
  }
}

Json Merged(Json json, const Json& more) {
  json.update(more);
  return json;
}

Json Means(const std::vector<rigs::monte_carlo::Estimate>& table) {
  Json means = Json::array();
  Json errors = Json::array();
  for (const rigs::monte_carlo::Estimate& cell : table) {
    means.push_back(cell.mean);
    errors.push_back(cell.se);
  }
  return {{"mean", means}, {"se", errors}};
}

// Totals with tables by angle and depth, which Monte Carlo alone has.
Json ResolvedTotals(const Task& task,
                    const rigs::Transport& transport,
                    std::size_t channel,
                    rigs::Totals& totals) {
  const auto* by_photons =
      dynamic_cast<const rigs::monte_carlo::MonteCarloTransport*>(&transport);
  if (by_photons == nullptr) {
    throw UsageError("--cosines and --depths need --solver mc");
  }
  const rigs::monte_carlo::Result r =
      by_photons->Simulate(task.Beam(),
                           channel,
                           {.cosine_count = task.args.cosine_count,
                            .depth_count = task.args.depth_count,
                            .depth_step_mm = task.args.depth_step_mm});
  totals = rigs::monte_carlo::ToTotals(r);
  Json json = Json::object();
  if (task.args.cosine_count > 0) {
    json["reflected_in_cosine"] = Means(r.reflected_in_cosine);
    json["transmitted_in_cosine"] = Means(r.transmitted_in_cosine);
  }
  if (task.args.depth_count > 0) {
    json["absorbed_in_depth"] = Means(r.absorbed_in_depth);
  }
  return json;
}

double Specular(const Task& task) {
  rigs::monte_carlo::Source source =
      rigs::monte_carlo::MakeSource(task.phantom.beam, {});
  source.diffuse = task.options.diffuse;
  return rigs::monte_carlo::SpecularReflectance(
      source, rigs::monte_carlo::MakeVolume(task.phantom, 0));
}

void RunTotals(Task& task) {
  const Selection selection = SelectFor(task, Quantity::kTotals);
  const bool resolved = task.args.cosine_count > 0 || task.args.depth_count > 0;
  Json channels = Json::array();
  std::string text;
  for (std::size_t c = 0; c < task.phantom.channels.size(); ++c) {
    rigs::Totals t;
    Json tables = Json::object();
    if (resolved) {
      tables = ResolvedTotals(task, *selection.transport, c, t);
    } else {
      t = selection.transport->TotalsAt(task.Beam(), c);
    }
    channels.push_back(Merged({{"name", task.phantom.channels[c]},
                               {"R", t.reflected},
                               {"R_se", t.reflected_se},
                               {"T", t.transmitted},
                               {"T_se", t.transmitted_se},
                               {"A", t.absorbed},
                               {"A_se", t.absorbed_se},
                               {"photons", t.photons}},
                              tables));
    text += fmt::format("{}{}: R {:.6f} ± {:.6f}  T {:.6f} ± {:.6f}  A {:.6f}",
                        c > 0 ? "\n" : "",
                        task.phantom.channels[c],
                        t.reflected,
                        t.reflected_se,
                        t.transmitted,
                        t.transmitted_se,
                        t.absorbed);
    SayIfMissed(task, t.photons > 0 ? rigs::monte_carlo::RelativeError(t) : 0);
  }
  Print(task.common,
        Merged({{"channels", channels}, {"specular", Specular(task)}},
               About(task, selection)),
        text);
}

ExrPart SlicePart(const Task& task,
                  const char* name,
                  const std::vector<float>& values) {
  ExrPart part;
  part.name = name;
  part.width = task.phantom.grid.core;
  part.height = task.phantom.grid.core;
  part.channels = task.phantom.channels;
  part.values = values;
  part.attributes = {{"nacre.units", "mm^-2"},
                     {"nacre.pitch_mm", fmt::format("{}", task.phantom.grid.pitch_mm)},
                     {"nacre.provenance", task.provenance.ToString()}};
  return part;
}

void RunBeam(Task& task) {
  RequireGrid(task);
  const Selection selection = SelectFor(task, Quantity::kWindow);
  task.provenance.options["beam_mm"] = task.args.beam_mm;
  rigs::Window window;
  const rigs::PointMm x_i = task.Beam();
  selection.transport->SolveWindows(
      {&x_i, 1},
      [&](std::size_t, rigs::Window&& solved) { window = std::move(solved); },
      ConsoleProgress(task.common));
  if (!task.common.IsRoot()) {
    return;
  }
  WriteExr(task.args.out,
           {SlicePart(task, "rd", window.rd), SlicePart(task, "stderr", window.sigma)});
  const WindowFigures figures = FiguresOf(task.phantom, window);
  SayIfMissed(task, figures.worst_noise);
  Print(task.common,
        Merged({{"file", task.args.out.string()},
                {"window_totals", figures.flux},
                {"noise", figures.noise}},
               About(task, selection)),
        task.args.out.string());
}

void RunPhoto(Task& task) {
  const std::vector<ExrPart> parts = ReadExr(task.args.photo);
  task.provenance.AddInput(task.args.photo);
  const Selection selection = SelectFor(task, Quantity::kWindow);
  rigs::Photo photo = rigs::PhotographUnder(task.phantom,
                                            selection.solver,
                                            parts.front(),
                                            task.options,
                                            ConsoleProgress(task.common));
  if (!task.common.IsRoot()) {
    return;
  }
  photo.exitance.name = "exitance";
  photo.exitance.attributes = {{"nacre.provenance", task.provenance.ToString()}};
  std::vector<ExrPart> result{std::move(photo.exitance)};
  if (!photo.standard_error.values.empty()) {
    photo.standard_error.name = "stderr";
    result.push_back(std::move(photo.standard_error));
  }
  WriteExr(task.args.out, result);
  Print(task.common,
        Merged({{"file", task.args.out.string()}}, About(task, selection)),
        task.args.out.string());
}

void RunDataset(Task& task) {
  RequireGrid(task);
  const Selection selection = SelectFor(task, Quantity::kWindow);
  const Phantom& phantom = task.phantom;
  const RdHeader header{.points_x = phantom.grid.points_x,
                        .points_y = phantom.grid.points_y,
                        .core = phantom.grid.core,
                        .pitch_mm = phantom.grid.pitch_mm,
                        .eta = phantom.slab.eta,
                        .channels = phantom.channels,
                        .provenance = task.provenance.ToString()};
  std::optional<RdWriter> writer;
  if (task.common.IsRoot()) {
    writer.emplace(task.args.out, header);
  }
  double worst_noise = 0;
  const rigs::GridSummary summary = rigs::SolveGrid(
      *selection.transport,
      [&](int i, int j, rigs::Window&& window) {
        worst_noise = std::max(worst_noise, FiguresOf(phantom, window).worst_noise);
        RdSlice slice = reconstruct::MakeSlice(header);
        slice.rd = std::move(window.rd);
        slice.sigma = std::move(window.sigma);
        writer->WriteSlice(i, j, slice);
      },
      ConsoleProgress(task.common));
  if (!task.common.IsRoot()) {
    return;
  }
  writer->Finish();
  SayIfMissed(task, worst_noise);
  Print(task.common,
        Merged({{"file", task.args.out.string()},
                {"points", {header.points_x, header.points_y}},
                {"distinct_points", summary.distinct},
                {"core", header.core},
                {"channels", header.channels},
                {"noise", NumberOrNull(worst_noise)}},
               About(task, selection)),
        task.args.out.string());
}

void CheckArguments(const SimulateArguments& args) {
  if (!args.photo.empty() && (!args.beam_mm.empty() || args.totals)) {
    throw UsageError("--photo goes with neither --beam nor --totals");
  }
  if (!args.totals && args.out.empty()) {
    throw UsageError("--out FILE is needed, unless only --totals are wanted");
  }
  for (const double coordinate : args.beam_mm) {
    if (!std::isfinite(coordinate)) {
      throw UsageError(fmt::format("--beam: {} is not a position in mm", coordinate));
    }
  }
  if (!args.totals && (args.cosine_count > 0 || args.depth_count > 0)) {
    throw UsageError("--cosines and --depths go with --totals");
  }
  if ((args.depth_count > 0) != (args.depth_step_mm > 0)) {
    throw UsageError("--depths N and --depth-step MM go together");
  }
  if (rigs::ParseSolver(args.solver) != Solver::kMonteCarlo &&
      rigs::ParseSolver(args.solver) != Solver::kAuto && args.options.photons > 0) {
    throw UsageError("--photons steers the mc solver; " + args.solver +
                     " is deterministic");
  }
}

int Run(const SimulateArguments& args, const Common& common) {
  CheckArguments(args);
  Task task{args, common, {}, args.options, {}, CpuSeconds()};
  task.options.seed = static_cast<std::int64_t>(common.seed);
  task.options.thread_count = common.thread_count;
  task.options.ranks = common.ranks;
  Validate(task.options);
  task.phantom = rigs::ReadPhantom(args.phantom);
  task.provenance.command = "simulate";
  task.provenance.options = OptionsToJson(task.options);
  task.provenance.options.erase("thread_count");  // it changes no result
  task.provenance.AddInput(args.phantom);
  if (args.totals) {
    RunTotals(task);
  } else if (!args.photo.empty()) {
    RunPhoto(task);
  } else if (!args.beam_mm.empty()) {
    RunBeam(task);
  } else {
    RunDataset(task);
  }
  return 0;
}

// Whole numbers as people write them: 2000000, 2e6.
std::string WholeNumber(const std::string& text) {
  try {
    std::size_t used = 0;
    const double value = std::stod(text, &used);
    if (used == text.size() && value == std::floor(value) && std::abs(value) < 1e18) {
      return fmt::format("{:.0f}", value);
    }
  } catch (const std::logic_error&) {
    // No number at all: CLI11 says so better.
    return text;
  }
  return text;
}

void AddMonteCarloOptions(CLI::App& app, SimulateArguments& args) {
  app.add_option(
         "--photons",
         args.options.photons,
         "mc: photons a beam and channel (1e6 if nothing is said); with --error "
         "the most")
      ->transform(WholeNumber)
      ->check(CLI::Range(1.0, 1e15));
  app.add_option("--error",
                 args.options.error,
                 "relative error: auto takes the cheapest solver that states it, mc "
                 "goes on until its noise is that")
      ->check(CLI::Range(1e-6, 1.0));
  app.add_flag("--diffuse",
               args.options.diffuse,
               "mc: light arrives by Lambert's law, not at the beam's angle");
  app.add_option(
         "--cosines",
         args.cosine_count,
         "mc, with --totals: R and T in so many bins of the exit angle's cosine")
      ->check(CLI::Range(0, 100'000));
  app.add_option(
         "--depths", args.depth_count, "mc, with --totals: A in so many bins of depth")
      ->check(CLI::Range(0, 1'000'000));
  app.add_option("--depth-step", args.depth_step_mm, "thickness of those, mm")
      ->check(CLI::PositiveNumber);
}

}  // namespace

std::function<int()> MakeSimulateVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<SimulateArguments>();
  app.add_option("phantom", args->phantom, "the slab and its media, TOML")->required();
  app.add_option("-o,--out", args->out, "what to write: *.rd.exr, or *.exr for a slice")
      ->type_name("FILE");
  app.add_option("--solver",
                 args->solver,
                 "mc, diffusion, fast, or auto for the cheapest that meets --error")
      ->capture_default_str();
  app.add_option("--beam", args->beam_mm, "one slice only, with the beam there (mm)")
      ->type_name("X,Y")
      ->delimiter(',')
      ->expected(2);
  app.add_option(
         "--photo",
         args->photo,
         "exitance under this image of irradiance, which covers the grid's area")
      ->type_name("EXR");
  app.add_flag(
      "--totals",
      args->totals,
      "reflected, transmitted and absorbed fractions of what enters at --beam, "
      "or at the origin");
  AddMonteCarloOptions(app, *args);
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli

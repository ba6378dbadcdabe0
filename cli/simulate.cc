// nacre simulate: R_d of a phantom by a model of light transport.

#include "cli/command_line.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/fresnel.h"
#include "core/parallel.h"
#include "core/provenance.h"
#include "reconstruct/rd_dataset.h"
#include "rigs/photo.h"
#include "rigs/transport/transport.h"

#include <ctime>
#include <filesystem>
#include <memory>
#include <vector>

namespace nacre::cli {
namespace {

using reconstruct::RdHeader;
using reconstruct::RdSlice;
using reconstruct::RdWriter;
using rigs::Phantom;
using rigs::Transport;

struct Arguments {
  std::filesystem::path phantom;
  std::filesystem::path out;
  std::string solver = "auto";
  std::vector<double> beam_mm;
  std::filesystem::path photo;
  bool totals = false;
  std::int64_t photons = 0;
  double error = 0;
};

struct Task {
  const Arguments& args;
  const Common& common;
  Phantom phantom;
  rigs::Solver solver;
  Provenance provenance;
  double cpu_start = 0;
};

double CpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void RequireGrid(const Task& task) {
  if (task.phantom.grid.points_x == 0) {
    throw BadData(task.args.phantom.string() +
                  ": no [grid], which says where R_d is wanted");
  }
}

// The flux that leaves within the window, a channel.
Json WindowTotals(const Phantom& phantom, const std::vector<float>& rd) {
  const double cell_mm2 = phantom.grid.pitch_mm * phantom.grid.pitch_mm;
  const std::size_t cells = rd.size() / phantom.channels.size();
  Json totals = Json::array();
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    double sum = 0;
    for (std::size_t k = 0; k < cells; ++k) {
      sum += static_cast<double>(rd[c * cells + k]);
    }
    totals.push_back(sum * cell_mm2);
  }
  return totals;
}

void RunTotals(const Task& task) {
  const std::unique_ptr<Transport> transport =
      rigs::MakeTransport(task.phantom, task.solver, task.common.thread_count);
  const std::vector<double>& beam = task.args.beam_mm;
  const rigs::PointMm x_i =
      beam.empty() ? rigs::PointMm{} : rigs::PointMm{beam[0], beam[1]};
  Json channels = Json::array();
  std::string text;
  for (std::size_t c = 0; c < task.phantom.channels.size(); ++c) {
    const rigs::Totals totals = transport->TotalsAt(x_i, c);
    channels.push_back({{"name", task.phantom.channels[c]},
                        {"R", totals.reflected},
                        {"R_se", 0.0},
                        {"T", totals.transmitted},
                        {"T_se", 0.0},
                        {"A", totals.absorbed}});
    text += fmt::format("{}{}: R {:.6f}  T {:.6f}  A {:.6f}",
                        c > 0 ? "\n" : "",
                        task.phantom.channels[c],
                        totals.reflected,
                        totals.transmitted,
                        totals.absorbed);
  }
  Print(task.common,
        Json{{"channels", channels},
             {"specular", FresnelReflectance(1, task.phantom.slab.eta)},
             {"solver", "fast"},
             {"cpu_seconds", CpuSeconds() - task.cpu_start}},
        text);
}

void RunBeam(Task& task) {
  RequireGrid(task);
  const std::unique_ptr<Transport> transport =
      rigs::MakeTransport(task.phantom, task.solver, task.common.thread_count);
  const rigs::Window window =
      transport->WindowAround({task.args.beam_mm[0], task.args.beam_mm[1]});
  const Json totals = WindowTotals(task.phantom, window.rd);
  ExrPart slice;
  slice.name = "rd";
  slice.width = task.phantom.grid.core;
  slice.height = task.phantom.grid.core;
  slice.channels = task.phantom.channels;
  slice.values = window.rd;
  task.provenance.options["beam_mm"] = task.args.beam_mm;
  slice.attributes = {{"nacre.units", "mm^-2"},
                      {"nacre.pitch_mm", fmt::format("{}", task.phantom.grid.pitch_mm)},
                      {"nacre.provenance", task.provenance.ToString()}};
  WriteExr(task.args.out, {slice});
  Print(task.common,
        Json{{"file", task.args.out.string()},
             {"window_totals", totals},
             {"solver", "fast"},
             {"cpu_seconds", CpuSeconds() - task.cpu_start}},
        task.args.out.string());
}

void RunPhoto(Task& task) {
  const std::vector<ExrPart> parts = ReadExr(task.args.photo);
  ExrPart photo = rigs::PhotographUnder(task.phantom,
                                        task.solver,
                                        parts.front(),
                                        task.common.thread_count,
                                        ConsoleProgress(task.common));
  task.provenance.AddInput(task.args.photo);
  photo.name = "exitance";
  photo.attributes = {{"nacre.provenance", task.provenance.ToString()}};
  WriteExr(task.args.out, {photo});
  Print(task.common,
        Json{{"file", task.args.out.string()},
             {"solver", "fast"},
             {"cpu_seconds", CpuSeconds() - task.cpu_start}},
        task.args.out.string());
}

void RunDataset(Task& task) {
  RequireGrid(task);
  const Phantom& phantom = task.phantom;
  const std::unique_ptr<Transport> transport =
      rigs::MakeTransport(phantom, task.solver, task.common.thread_count);
  const RdHeader header{.points_x = phantom.grid.points_x,
                        .points_y = phantom.grid.points_y,
                        .core = phantom.grid.core,
                        .pitch_mm = phantom.grid.pitch_mm,
                        .eta = phantom.slab.eta,
                        .channels = phantom.channels,
                        .provenance = task.provenance.ToString()};
  RdWriter writer(task.args.out, header);
  const ProgressFunction progress = ConsoleProgress(task.common);
  // A few rows of slices are in memory at a time, whatever the size of the dataset.
  constexpr int kRows = 4;
  for (int first = 0; first < header.points_y; first += kRows) {
    const int rows = std::min(kRows, header.points_y - first);
    const std::int64_t count = std::int64_t{rows} * header.points_x;
    std::vector<rigs::Window> windows(static_cast<std::size_t>(count));
    ParallelFor(count, task.common.thread_count, [&](std::int64_t k) {
      const int i = static_cast<int>(k % header.points_x);
      const int j = first + static_cast<int>(k / header.points_x);
      windows[static_cast<std::size_t>(k)] =
          transport->WindowAround(phantom.grid.Point(i, j));
    });
    for (std::int64_t k = 0; k < count; ++k) {
      RdSlice slice = reconstruct::MakeSlice(header);
      slice.rd = std::move(windows[static_cast<std::size_t>(k)].rd);
      slice.sigma = std::move(windows[static_cast<std::size_t>(k)].sigma);
      writer.WriteSlice(static_cast<int>(k % header.points_x),
                        first + static_cast<int>(k / header.points_x),
                        slice);
    }
    Report(progress, {"simulate", first + rows, header.points_y, "rows"});
  }
  writer.Finish();
  Print(task.common,
        Json{{"file", task.args.out.string()},
             {"points", {header.points_x, header.points_y}},
             {"core", header.core},
             {"channels", header.channels},
             {"solver", "fast"},
             {"cpu_seconds", CpuSeconds() - task.cpu_start}},
        task.args.out.string());
}

void CheckArguments(const Arguments& args) {
  if (!args.photo.empty() && (!args.beam_mm.empty() || args.totals)) {
    throw UsageError("--photo goes with neither --beam nor --totals");
  }
  if (!args.totals && args.out.empty()) {
    throw UsageError("--out FILE is needed, unless only --totals are wanted");
  }
  if (args.photons != 0 || args.error != 0) {
    throw UsageError(
        "--photons and --error steer the mc solver, which this build doesn't have; the "
        "fast one is deterministic");
  }
}

int Run(const Arguments& args, const Common& common) {
  Task task{args, common, {}, rigs::ParseSolver(args.solver), {}, CpuSeconds()};
  CheckArguments(args);
  task.phantom = rigs::ReadPhantom(args.phantom);
  task.provenance.command = "simulate";
  task.provenance.options = Json{{"solver", "fast"}};
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

}  // namespace

std::function<int()> MakeSimulateVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<Arguments>();
  app.add_option("phantom", args->phantom, "the slab and its media, TOML")->required();
  app.add_option("-o,--out", args->out, "what to write: *.rd.exr, or *.exr for a slice")
      ->type_name("FILE");
  app.add_option("--solver", args->solver, "fast, or auto for the best there is")
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
  app.add_option("--photons", args->photons, "for solvers that trace photons");
  app.add_option("--error", args->error, "for solvers that trace photons");
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli

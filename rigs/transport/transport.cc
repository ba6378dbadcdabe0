#include "rigs/transport/transport.h"

#include "core/error.h"
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "rigs/transport/path_averaged.h"
#include "rigs/transport/solve_units.h"
#include "rigs/transport/solver_choice.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <utility>

namespace nacre::rigs {
namespace {

constexpr std::array kSolvers = {
    Solver::kAuto, Solver::kFast, Solver::kDiffusion, Solver::kMonteCarlo};

monte_carlo::Options PhotonOptions(const SolverOptions& options) {
  constexpr std::int64_t kUsual = 1'000'000;
  constexpr std::int64_t kMost = 20'000'000'000;  // for an error; hours of a machine
  const std::int64_t photons = options.photons > 0 ? options.photons
                               : options.error > 0 ? kMost
                                                   : kUsual;
  return {.photon_count = photons,
          .seed = options.seed,
          .thread_count = options.thread_count,
          .ranks = options.ranks};
}

std::unique_ptr<Transport> MakeDiffusion(const Phantom& phantom,
                                         const SolverOptions& options) {
  DiffusionOptions diffusion;
  diffusion.reference_seed = options.seed;
  diffusion.thread_count = options.thread_count;
  diffusion.ranks = options.ranks;
  if (!options.near_field) {
    diffusion.reference_photons = 0;
  }
  return std::make_unique<DiffusionTransport>(phantom, diffusion);
}

std::size_t WindowValues(const Phantom& phantom) {
  return static_cast<std::size_t>(phantom.grid.core) *
         static_cast<std::size_t>(phantom.grid.core) * phantom.channels.size();
}

// Windows one after the other; their sigmas behind them, unless all of them are 0.
std::vector<float> ToValues(const std::vector<Window>& windows) {
  std::vector<float> values;
  bool noisy = false;
  for (const Window& window : windows) {
    values.insert(values.end(), window.rd.begin(), window.rd.end());
    noisy = noisy || std::any_of(window.sigma.begin(), window.sigma.end(), [](float s) {
              return s != 0;
            });
  }
  for (const Window& window : windows) {
    values.insert(values.end(),
                  window.sigma.begin(),
                  window.sigma.begin() + (noisy ? std::ssize(window.sigma) : 0));
  }
  return values;
}

std::vector<Window> ToWindows(std::span<const float> values,
                              std::size_t count,
                              std::size_t size) {
  const bool noisy = values.size() > count * size;
  Expect(values.size() == (noisy ? 2 : 1) * count * size, "whole windows");
  std::vector<Window> windows(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::span<const float> rd = values.subspan(k * size, size);
    windows[k].rd.assign(rd.begin(), rd.end());
    windows[k].sigma.resize(size);
    if (noisy) {
      const std::span<const float> sigma = values.subspan((count + k) * size, size);
      windows[k].sigma.assign(sigma.begin(), sigma.end());
    }
  }
  return windows;
}

}  // namespace

void Transport::SolveInUnits(
    const std::vector<std::vector<std::size_t>>& units,
    const std::function<std::vector<Window>(std::size_t unit)>& solve,
    const std::function<void(std::size_t k, Window&& window)>& use,
    const ProgressFunction& progress) const {
  std::int64_t done = 0;
  std::int64_t total = 0;
  for (const std::vector<std::size_t>& unit : units) {
    total += std::ssize(unit);
  }
  SolveUnits(
      {.ranks = ranks_, .thread_count = thread_count_},
      std::ssize(units),
      [&](std::int64_t unit) {
        return ToValues(solve(static_cast<std::size_t>(unit)));
      },
      [&](std::int64_t unit, std::span<const float> values) {
        const std::vector<std::size_t>& of = units[static_cast<std::size_t>(unit)];
        std::vector<Window> windows =
            ToWindows(values, of.size(), WindowValues(phantom()));
        for (std::size_t k = 0; k < of.size(); ++k) {
          use(of[k], std::move(windows[k]));
        }
        done += std::ssize(of);
        Report(progress, {"simulate", done, total, "windows"});
      });
}

void Transport::SolveWindows(
    std::span<const PointMm> points,
    const std::function<void(std::size_t k, Window&& window)>& use,
    const ProgressFunction& progress) const {
  std::vector<std::vector<std::size_t>> one_each;
  for (std::size_t k = 0; k < points.size(); ++k) {
    one_each.push_back({k});
  }
  SolveInUnits(
      one_each,
      [&](std::size_t k) { return std::vector<Window>{WindowAround(points[k])}; },
      use,
      progress);
}

const char* Name(Solver solver) {
  switch (solver) {
    case Solver::kAuto:
      return "auto";
    case Solver::kFast:
      return "fast";
    case Solver::kDiffusion:
      return "diffusion";
    case Solver::kMonteCarlo:
      return "mc";
  }
  throw LogicError("a solver of no kind");
}

Solver ParseSolver(const std::string& name) {
  std::string known;
  for (const Solver solver : kSolvers) {
    if (name == Name(solver)) {
      return solver;
    }
    known += (known.empty() ? "" : ", ") + std::string(Name(solver));
  }
  throw UsageError(
      fmt::format("--solver {}: there is no such solver; there are: {}", name, known));
}

std::unique_ptr<Transport> MakeTransport(const Phantom& phantom,
                                         Solver solver,
                                         const SolverOptions& options,
                                         const ProgressFunction& progress) {
  Validate(options);
  if (options.diffuse && (solver == Solver::kFast || solver == Solver::kDiffusion)) {
    throw BadData(
        fmt::format("the {} solver can't do diffuse light; use mc", Name(solver)));
  }
  switch (solver) {
    case Solver::kAuto:
      return SelectSolver(phantom, options, Quantity::kWindow, progress).transport;
    case Solver::kFast:
      return std::make_unique<PathAveraged>(
          phantom, options.thread_count, options.ranks);
    case Solver::kDiffusion:
      return MakeDiffusion(phantom, options);
    case Solver::kMonteCarlo:
      return std::make_unique<monte_carlo::MonteCarloTransport>(
          phantom,
          PhotonOptions(options),
          monte_carlo::BeamOptions{.wanted_error = options.error,
                                   .diffuse = options.diffuse},
          progress);
  }
  throw LogicError("a solver of no kind");
}

std::unique_ptr<Transport> MakeTransport(const Phantom& phantom,
                                         Solver solver,
                                         int thread_count) {
  return MakeTransport(phantom, solver, SolverOptions{.thread_count = thread_count});
}

}  // namespace nacre::rigs

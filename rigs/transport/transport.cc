#include "rigs/transport/transport.h"

#include "core/error.h"
#include "core/parallel.h"
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "rigs/transport/path_averaged.h"
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
          .thread_count = options.thread_count};
}

std::unique_ptr<Transport> MakeDiffusion(const Phantom& phantom,
                                         const SolverOptions& options) {
  DiffusionOptions diffusion;
  diffusion.reference_seed = options.seed;
  diffusion.thread_count = options.thread_count;
  if (!options.near_field) {
    diffusion.reference_photons = 0;
  }
  return std::make_unique<DiffusionTransport>(phantom, diffusion);
}

}  // namespace

void Transport::SolveWindows(
    std::span<const PointMm> points,
    const std::function<void(std::size_t k, Window&& window)>& use,
    const ProgressFunction& progress) const {
  // Enough for all cores; few enough to forget.
  constexpr std::size_t kAtOnce = 128;
  const std::size_t count = points.size();
  for (std::size_t first = 0; first < count; first += kAtOnce) {
    std::vector<Window> windows(std::min(kAtOnce, count - first));
    ParallelFor(
        static_cast<std::int64_t>(windows.size()), thread_count_, [&](std::int64_t k) {
          const auto at = static_cast<std::size_t>(k);
          windows[at] = WindowAround(points[first + at]);
        });
    for (std::size_t k = 0; k < windows.size(); ++k) {
      use(first + k, std::move(windows[k]));
    }
    Report(progress,
           {"simulate",
            static_cast<std::int64_t>(first + windows.size()),
            static_cast<std::int64_t>(count),
            "windows"});
  }
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
      return std::make_unique<PathAveraged>(phantom, options.thread_count);
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

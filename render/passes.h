#pragma once

#include "render/integrators/caustic_photons.h"
#include "render/job_queue.h"
#include "render/render.h"
#include "render/sample_plan.h"
#include "render/stopwatch.h"
#include "render/tile_pass.h"

#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

namespace nacre::render {

/// Who is told of samples, and where they are kept.
struct PassOutlets {
  const ProgressFunction& progress;
  const SnapshotFunction& snapshot;
  const Checkpoint& checkpoint;
};

/// The passes of a picture: each brings every tile to the number of samples that the
/// plan wants, by all threads of all ranks. The root alone has the film; the others
/// serve it. References must outlive it.
class Passes {
 public:
  Passes(const Scene& scene,
         const RenderOptions& options,
         const SamplePlan& plan,
         PathTracer& tracer,
         Accumulator& film);

  /// A map of photons, each rank its own, for each sample of the pixels.
  void UseCaustics(const World& world, const IntegratorSettings& settings);

  /// At the root: all passes, an `unfinished` one (of a checkpoint) first. If that is
  /// stopped, samples made so far are in the checkpoint. `seconds_before`: of the wall,
  /// for the time limit.
  void Run(const std::vector<int>& unfinished,
           double seconds_before,
           const PassOutlets& outlets,
           RenderSummary& summary);

  /// At other ranks: until the root has all it needs.
  void ServeRoot();

 private:
  void MakeMap(std::int64_t sample);
  void RunPass(const std::vector<int>& pass, const PassOutlets& outlets);
  void Note(const TileCounters& counters, const PassOutlets& outlets);
  void KeepIfDue(const std::vector<int>& pass, const PassOutlets& outlets);
  bool TimeLeft(std::int64_t samples) const;

  const RenderOptions& options_;
  const SamplePlan& plan_;
  PathTracer& tracer_;
  Accumulator& film_;
  TilePass tiles_;
  JobQueue queue_;
  std::optional<CausticPhotons> caustics_;
  PhotonMap photons_;
  std::mutex note_mutex_;
  TileCounters counters_;
  std::int64_t made_before_ = 0;
  double seconds_before_ = 0;
  Stopwatch watch_;
  Stopwatch since_snapshot_;
  Stopwatch since_checkpoint_;
};

}  // namespace nacre::render

#pragma once

#include "render/accumulator.h"
#include "render/film.h"
#include "render/integrators/path.h"
#include "render/path_counters.h"
#include "render/sample_plan.h"
#include "render/scene.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace nacre::render {

/// What was done for some tiles.
struct TileCounters {
  PathCounters paths;
  std::int64_t samples = 0;
  std::int64_t bad = 0;      ///< samples that weren't finite
  std::int64_t clamped = 0;  ///< samples

  TileCounters& operator+=(const TileCounters& other);
};

struct SampleSettings {
  std::uint64_t seed = 1;
  double clamp = 0;  ///< upper bound of a sample's radiance; 0: none
};

/// Traces samples tile by tile, adding them to the film's sums. A sample depends on its
/// pixel and number alone, and the sums on the order within a pixel, so it doesn't
/// matter who traces which tile. References must outlive it.
class TilePass {
 public:
  TilePass(const Scene& scene,
           const PathTracer& tracer,
           const SampleSettings& settings,
           const SamplePlan& plan,
           Accumulator& film);

  /// Adds to the samples of a tile's pixels up to that number of them. Tiles may be
  /// traced from several threads; of one that is left by an exception, the samples so
  /// far are kept.
  TileCounters Trace(std::int64_t tile, int up_to);

  bool IsDone(std::int64_t tile, int up_to) const;

  /// The same by another rank: what it needs to know, what it makes of that (its film
  /// is overwritten), and what becomes of the film here.
  std::string Describe(std::int64_t tile, int up_to) const;
  std::string TraceDescribed(std::string_view description);
  TileCounters TakeResult(std::int64_t tile, std::string_view result);

 private:
  PixelBlock BlockOf(std::int64_t tile) const;
  std::size_t PixelAt(int x, int y) const;
  void AddSample(int x, int y, int sample, TileCounters& counters);

  const Film& film_;
  const Camera& camera_;
  const PathTracer& tracer_;
  SampleSettings settings_;
  const SamplePlan& plan_;
  FilterSampler filter_;
  Accumulator& accumulator_;
};

}  // namespace nacre::render

#include "render/render.h"

#include "core/error.h"
#include "core/parallel.h"
#include "render/accumulator.h"
#include "render/exitances.h"
#include "render/integrators/path.h"
#include "render/stopwatch.h"
#include "render/world.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <mutex>

namespace nacre::render {
namespace {

IntegratorSettings ChooseIntegrator(const Scene& scene, const std::string& name) {
  IntegratorSettings settings = scene.integrator;
  if (name == "path" || name == "fast" || name == "reference") {
    settings.kind = IntegratorSettings::Kind::kPath;
  } else if (name == "direct") {
    settings.kind = IntegratorSettings::Kind::kDirect;
  } else if (name != "scene") {
    throw UsageError("no integrator '" + name +
                     "': there are scene, path, direct, fast and reference");
  }
  return settings;
}

constexpr int kTile = 16;

// Traces the samples of one pass, tile by tile.
class Pass {
 public:
  Pass(const Scene& scene,
       const PathTracer& tracer,
       const RenderOptions& options,
       Accumulator& film)
      : film_(scene.film),
        camera_(scene.camera),
        tracer_(tracer),
        options_(options),
        filter_(scene.film),
        accumulator_(film),
        tiles_x_((film_.crop_width + kTile - 1) / kTile),
        tiles_y_((film_.crop_height + kTile - 1) / kTile) {}

  std::int64_t TileCount() const { return std::int64_t{tiles_x_} * tiles_y_; }

  /// Samples [first, last) of each pixel.
  void Run(int first,
           int last,
           const std::function<void(std::int64_t)>& tile_done,
           RenderSummary& summary) {
    std::vector<TileCounters> counters(static_cast<std::size_t>(TileCount()));
    ParallelFor(TileCount(), options_.thread_count, [&](std::int64_t tile) {
      RunTile(tile, first, last, counters[static_cast<std::size_t>(tile)]);
      tile_done(tile);
    });
    for (const TileCounters& tile : counters) {
      summary.rays += tile.paths.rays;
      summary.shadow_rays += tile.paths.shadow_rays;
      summary.exitances += tile.paths.exitances;
      summary.evaluations += tile.paths.evaluations;
      summary.pairs += tile.paths.pairs;
      summary.probes += tile.paths.probes;
      summary.probes_cut += tile.paths.probes_cut;
      summary.bad_samples += tile.bad;
      summary.clamped_samples += tile.clamped;
    }
  }

 private:
  struct TileCounters {
    PathCounters paths;
    std::int64_t bad = 0;
    std::int64_t clamped = 0;
  };

  void RunTile(std::int64_t tile, int first, int last, TileCounters& counters) {
    const int x0 = static_cast<int>(tile % tiles_x_) * kTile;
    const int y0 = static_cast<int>(tile / tiles_x_) * kTile;
    const int x1 = std::min(x0 + kTile, film_.crop_width);
    const int y1 = std::min(y0 + kTile, film_.crop_height);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        for (int sample = first; sample < last; ++sample) {
          AddSample(x, y, sample, counters);
        }
      }
    }
  }

  void AddSample(int x, int y, int sample, TileCounters& counters) {
    // Named by the place on the full film: a crop shows the same noise.
    const int film_x = film_.crop_x + x;
    const int film_y = film_.crop_y + y;
    const std::uint64_t pixel_seed = MixSeed(
        options_.seed,
        static_cast<std::uint64_t>(film_y) * static_cast<std::uint64_t>(film_.width) +
            static_cast<std::uint64_t>(film_x));
    Sampler sampler(pixel_seed, static_cast<std::uint32_t>(sample));
    const FilterSampler::Sample filter = filter_(sampler.Next2D());
    const Vec2 position{static_cast<float>(film_x) + 0.5F + filter.offset.x,
                        static_cast<float>(film_y) + 0.5F + filter.offset.y};
    const Ray ray = CameraRay(camera_, position, film_.width, film_.height);
    PathTracer::Result result = tracer_.Radiance(ray, sampler, counters.paths);
    const float brightest = MaxComponent(result.radiance);
    const float bound = static_cast<float>(options_.clamp);
    if (bound > 0 && brightest > bound && std::isfinite(brightest)) {
      result.radiance *= bound / brightest;
      ++counters.clamped;
    }
    const auto pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(film_.crop_width) +
        static_cast<std::size_t>(x);
    if (!accumulator_.Add(pixel, result.radiance, result.alpha, filter.weight)) {
      ++counters.bad;
    }
  }

  const Film& film_;
  const Camera& camera_;
  const PathTracer& tracer_;
  const RenderOptions& options_;
  FilterSampler filter_;
  Accumulator& accumulator_;
  int tiles_x_;
  int tiles_y_;
};

// Passes grow, so that a first picture is there soon and a time limit is kept closely;
// powers of two keep each prefix of the samples well spread.
int NextPassEnd(int done, int total) {
  constexpr int kLargest = 16;
  return std::min(total, done + std::clamp(done, 1, kLargest));
}

int SamplesAtMost(const Scene& scene, const RenderOptions& options) {
  constexpr int kEnough = 65536;
  return options.spp > 0            ? options.spp
         : options.error_target > 0 ? kEnough
                                    : scene.samples_per_pixel;
}

class PassSchedule {
 public:
  PassSchedule(const RenderOptions& options, double seconds_before)
      : options_(options), seconds_before_(seconds_before) {}

  /// Whether a pass of that many samples still fits, judged by the ones before.
  bool TimeLeft(int done, int samples) const {
    if (options_.time_limit_s <= 0 || done == 0) {
      return true;
    }
    const double spent = watch_.Seconds();
    return seconds_before_ + spent * (1 + static_cast<double>(samples) / done) <=
           options_.time_limit_s;
  }

  bool SnapshotDue() {
    if (options_.snapshot_s <= 0 || since_snapshot_.Seconds() < options_.snapshot_s) {
      return false;
    }
    since_snapshot_ = Stopwatch();
    return true;
  }

  double Seconds() const { return watch_.Seconds(); }

 private:
  const RenderOptions& options_;
  double seconds_before_;
  Stopwatch watch_;
  Stopwatch since_snapshot_;
};

void DescribeScene(const Scene& scene, const World& world, RenderSummary& summary) {
  summary.width = scene.film.crop_width;
  summary.height = scene.film.crop_height;
  summary.lights = static_cast<std::int64_t>(world.light_count());
  for (const Shape& shape : scene.shapes) {
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape.geometry)) {
      summary.triangles += static_cast<std::int64_t>(mesh->triangles.size());
    }
  }
}

}  // namespace

Rendering Render(const Scene& scene,
                 const RenderOptions& options,
                 const ProgressFunction& progress,
                 const SnapshotFunction& snapshot) {
  Validate(options);
  const IntegratorSettings settings = ChooseIntegrator(scene, options.integrator);
  const Stopwatch total;
  const CpuStopwatch cpu;
  Rendering rendering;
  RenderSummary& summary = rendering.summary;
  summary.thread_count_used = ThreadCount(options.thread_count);

  const World world(scene, options.thread_count);
  summary.build_s = total.Seconds();
  DescribeScene(scene, world, summary);
  const Exitances exitances(world, settings, options, progress, summary);

  const PathTracer tracer(world, exitances.sources(), settings);
  Accumulator film(scene.film);
  Pass pass(scene, tracer, options, film);
  PassSchedule schedule(options, total.Seconds());
  const int spp = SamplesAtMost(scene, options);
  int done = 0;
  std::mutex report_mutex;
  while (done < spp && !(options.error_target > 0 &&
                         film.RelativeError(done) <= options.error_target)) {
    const int end = NextPassEnd(done, spp);
    if (!schedule.TimeLeft(done, end - done)) {
      summary.time_ran_out = true;
      break;
    }
    std::int64_t tiles = 0;
    pass.Run(
        done,
        end,
        [&](std::int64_t) {
          const std::lock_guard lock(report_mutex);
          ++tiles;
          Report(progress,
                 {"render",
                  done * pass.TileCount() + tiles * (end - done),
                  spp * pass.TileCount(),
                  ""});
        },
        summary);
    done = end;
    if (snapshot && done < spp && schedule.SnapshotDue()) {
      snapshot(film.ToImage(done));
    }
  }
  summary.samples_per_pixel = done;
  summary.relative_error = film.RelativeError(done);
  summary.paths_s = schedule.Seconds();
  exitances.AddUse(summary.use);
  summary.cpu_s = cpu.Seconds();
  rendering.image = film.ToImage(done);
  return rendering;
}

}  // namespace nacre::render

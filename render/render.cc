#include "render/render.h"

#include "core/error.h"
#include "core/parallel.h"
#include "render/exitances.h"
#include "render/integrators/caustic_photons.h"
#include "render/integrators/path.h"
#include "render/sample_plan.h"
#include "render/stopwatch.h"
#include "render/world.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <mutex>
#include <optional>

namespace nacre::render {
namespace {

// Whether photons can bring what this scene's glass and mirrors throw.
void CheckPhotons(const Scene& scene, const RenderOptions& options) {
  if (options.sampling == "adaptive") {
    throw UsageError(
        "--sampling adaptive doesn't go with sppm, of which each sample has photons of "
        "its own");
  }
  for (const Shape& shape : scene.shapes) {
    if (shape.interior != nullptr || shape.exterior != nullptr) {
      throw UsageError("sppm can't take photons through media (shape '" + shape.name +
                       "'): use volpath");
    }
  }
}

IntegratorSettings ChooseIntegrator(const Scene& scene, const std::string& name) {
  IntegratorSettings settings = scene.integrator;
  settings.photons.enabled =
      name == "sppm" || (name == "scene" && settings.photons.enabled);
  if (name == "path" || name == "fast" || name == "reference" || name == "sppm") {
    settings.kind = IntegratorSettings::Kind::kPath;
  } else if (name == "direct") {
    settings.kind = IntegratorSettings::Kind::kDirect;
  } else if (name != "scene") {
    throw UsageError("no integrator '" + name +
                     "': there are scene, path, direct, fast, sppm and reference");
  }
  return settings;
}

Sampling ChooseSampling(const IntegratorSettings& settings,
                        const RenderOptions& options) {
  if (options.sampling == "even") {
    return Sampling::kEven;
  }
  if (options.sampling == "adaptive") {
    return Sampling::kAdaptive;
  }
  if (options.sampling != "auto") {
    throw UsageError("no sampling '" + options.sampling +
                     "': there are auto, even and adaptive");
  }
  // Photons come a sample of all pixels at a time; what is a reference has no bias.
  return settings.photons.enabled || options.integrator == "reference"
             ? Sampling::kEven
             : Sampling::kAsGoodAsEven;
}

// Traces the samples of one pass, tile by tile.
class Pass {
 public:
  Pass(const Scene& scene,
       const PathTracer& tracer,
       const RenderOptions& options,
       const SamplePlan& plan,
       Accumulator& film)
      : film_(scene.film),
        camera_(scene.camera),
        tracer_(tracer),
        options_(options),
        plan_(plan),
        filter_(scene.film),
        accumulator_(film) {}

  /// The samples of each tile's pixels up to a number of them. `tile_done` gets how
  /// many were made.
  void Run(const std::vector<int>& up_to,
           const std::function<void(std::int64_t)>& tile_done,
           RenderSummary& summary) {
    std::vector<TileCounters> counters(up_to.size());
    ParallelFor(plan_.TileCount(), options_.thread_count, [&](std::int64_t tile) {
      const auto i = static_cast<std::size_t>(tile);
      RunTile(tile, up_to[i], counters[i]);
      tile_done(counters[i].samples);
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
    std::int64_t samples = 0;
    std::int64_t bad = 0;
    std::int64_t clamped = 0;
  };

  void RunTile(std::int64_t tile, int up_to, TileCounters& counters) {
    constexpr int kTile = SamplePlan::kTile;
    const int x0 = static_cast<int>(tile % plan_.tiles_x()) * kTile;
    const int y0 = static_cast<int>(tile / plan_.tiles_x()) * kTile;
    const int x1 = std::min(x0 + kTile, film_.crop_width);
    const int y1 = std::min(y0 + kTile, film_.crop_height);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const auto pixel =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(film_.crop_width) +
            static_cast<std::size_t>(x);
        const auto done = static_cast<int>(accumulator_.SamplesMade(pixel));
        for (int sample = done; sample < up_to; ++sample) {
          AddSample(x, y, sample, counters);
        }
        counters.samples += std::max(0, up_to - done);
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
  const SamplePlan& plan_;
  FilterSampler filter_;
  Accumulator& accumulator_;
};

int SamplesAtMost(const Scene& scene, const RenderOptions& options) {
  constexpr int kEnough = 65536;
  return options.spp > 0            ? options.spp
         : options.error_target > 0 ? kEnough
                                    : scene.samples_per_pixel;
}

class Schedule {
 public:
  Schedule(const RenderOptions& options, double seconds_before)
      : options_(options), seconds_before_(seconds_before) {}

  /// Whether that many more samples still fit, judged by those `made` since the start.
  bool TimeLeft(std::int64_t made, std::int64_t samples) const {
    if (options_.time_limit_s <= 0 || made == 0) {
      return true;
    }
    const double share = static_cast<double>(samples) / static_cast<double>(made);
    return seconds_before_ + watch_.Seconds() * (1 + share) <= options_.time_limit_s;
  }

  bool SnapshotDue() { return IsDue(options_.snapshot_s, since_snapshot_); }
  bool CheckpointDue() {
    constexpr double kEvery = 10;
    return IsDue(kEvery, since_checkpoint_);
  }

  double Seconds() const { return watch_.Seconds(); }

 private:
  static bool IsDue(double every_s, Stopwatch& since) {
    if (every_s <= 0 || since.Seconds() < every_s) {
      return false;
    }
    since = Stopwatch();
    return true;
  }

  const RenderOptions& options_;
  double seconds_before_;
  Stopwatch watch_;
  Stopwatch since_snapshot_;
  Stopwatch since_checkpoint_;
};

std::int64_t SamplesMade(const Accumulator& film) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < film.PixelCount(); ++i) {
    sum += film.SamplesMade(i);
  }
  return sum;
}

void DescribeSamples(const Accumulator& film, RenderSummary& summary) {
  const auto pixels = static_cast<std::int64_t>(film.PixelCount());
  summary.samples_per_pixel = static_cast<int>(SamplesMade(film) / pixels);
  summary.samples_least = static_cast<int>(film.SamplesMade(0));
  for (std::size_t i = 0; i < film.PixelCount(); ++i) {
    const auto made = static_cast<int>(film.SamplesMade(i));
    summary.samples_least = std::min(summary.samples_least, made);
    summary.samples_most = std::max(summary.samples_most, made);
  }
  summary.relative_error = film.RelativeError();
}

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
                 const SnapshotFunction& snapshot,
                 const Checkpoint& checkpoint) {
  Validate(options);
  const IntegratorSettings settings = ChooseIntegrator(scene, options.integrator);
  if (settings.photons.enabled) {
    CheckPhotons(scene, options);
  }
  const Stopwatch total;
  const CpuStopwatch cpu;
  Rendering rendering;
  RenderSummary& summary = rendering.summary;
  summary.thread_count_used = ThreadCount(options.thread_count);
  const bool keep = !checkpoint.path.empty();
  Accumulator film(scene.film);
  if (keep && ReadCheckpoint(checkpoint, film)) {
    summary.samples_resumed = static_cast<int>(
        SamplesMade(film) / static_cast<std::int64_t>(film.PixelCount()));
  }

  const World world(scene, options.thread_count);
  summary.build_s = total.Seconds();
  DescribeScene(scene, world, summary);
  const Exitances exitances(world, settings, options, progress, summary);

  PathTracer tracer(world, exitances.sources(), settings);
  std::optional<CausticPhotons> caustics;
  if (settings.photons.enabled) {
    caustics.emplace(world, settings.photons, settings.max_depth);
  }
  PhotonMap photons;
  const SamplePlan plan(scene.film,
                        {.spp = SamplesAtMost(scene, options),
                         .error_target = options.error_target,
                         .sampling = ChooseSampling(settings, options)});
  Pass pass(scene, tracer, options, plan, film);
  Schedule schedule(options, total.Seconds());
  const std::int64_t made_before = SamplesMade(film);
  std::int64_t made = made_before;
  std::mutex report_mutex;
  for (std::vector<int> next = plan.Next(film); !next.empty(); next = plan.Next(film)) {
    if (caustics) {
      // A map for each sample of the pixels.
      std::fill(next.begin(), next.end(), static_cast<int>(film.SamplesMade(0)) + 1);
    }
    if (!schedule.TimeLeft(made - made_before, plan.SamplesUpTo(next) - made)) {
      summary.time_ran_out = true;
      break;
    }
    if (caustics) {
      photons = caustics->Map(film.SamplesMade(0), options.seed, options.thread_count);
      tracer.UsePhotons(&photons);
    }
    pass.Run(
        next,
        [&](std::int64_t samples) {
          const std::lock_guard lock(report_mutex);
          made += samples;
          Report(progress, {"render", made, plan.SamplesAtMost(), ""});
        },
        summary);
    if (snapshot && schedule.SnapshotDue()) {
      snapshot(film.ToImage());
    }
    if (keep && schedule.CheckpointDue()) {
      WriteCheckpoint(checkpoint, film);
    }
  }
  if (keep) {
    WriteCheckpoint(checkpoint, film);
  }
  DescribeSamples(film, summary);
  summary.paths_s = schedule.Seconds();
  exitances.AddUse(summary.use);  // by the picture, before the check asks for more
  rendering.image = film.ToImage();
  CheckPixels(rendering.image, scene.film, summary.invariants);
  summary.invariants.objects = exitances.Energies(options.thread_count);
  summary.cpu_s = cpu.Seconds();
  if (options.aovs) {
    rendering.aovs = film.ToAovs();
  }
  return rendering;
}

}  // namespace nacre::render

#include "render/exitances.h"

#include "core/parallel.h"
#include "render/exitance_field.h"
#include "render/integrators/reference.h"
#include "render/lit_points.h"
#include "render/stopwatch.h"

#include <algorithm>

namespace nacre::render {
namespace {

// Paths that look for what is seen: enough for each cell of SeenPlaces on a film of any
// size, and less than a sample a pixel of a usual one.
constexpr std::int64_t kSeeingPaths = 1 << 18;

// One path through each of some places spread over the film: all of it, so that a crop
// shows the same pixels as the whole.
void TraceSeeingPaths(const World& world,
                      const PathTracer& tracer,
                      const RenderOptions& options) {
  const Film& film = world.scene().film;
  constexpr std::int64_t kBlock = 1024;
  const std::uint64_t seed = MixSeed(options.seed, 0x5EE9);
  ParallelForBlocks(
      kSeeingPaths,
      kBlock,
      options.thread_count,
      [&](std::int64_t begin, std::int64_t end) {
        PathCounters counters;
        for (std::int64_t i = begin; i < end; ++i) {
          const Vec2 u = SobolPoint(static_cast<std::uint32_t>(i));
          const Vec2 position{u.x * static_cast<float>(film.width),
                              u.y * static_cast<float>(film.height)};
          Sampler sampler(seed, static_cast<std::uint32_t>(i));
          tracer.Radiance(
              CameraRay(world.scene().camera, position, film.width, film.height),
              sampler,
              counters);
        }
      });
}

}  // namespace

Exitances::Exitances(const World& world,
                     const IntegratorSettings& settings,
                     const RenderOptions& options,
                     const ProgressFunction& progress,
                     RenderSummary& summary)
    : world_(world),
      settings_(settings),
      none_(world.scene().shapes.size()),
      indirect_(world, none_, settings),
      seen_(none_.size()),
      owned_(none_.size()),
      sources_(none_.size()) {
  const auto& shapes = world.scene().shapes;
  const auto translucent = [](const Shape& shape) {
    return shape.translucency.has_value();
  };
  const std::int64_t total = std::count_if(shapes.begin(), shapes.end(), translucent);
  const bool reference = options.integrator == "reference";
  if (options.lazy && !reference && total > 0) {
    const Stopwatch seen_time;
    FindSeen(options);
    summary.seen_s = seen_time.Seconds();
  }
  std::int64_t done = 0;
  for (std::uint32_t i = 0; i < shapes.size(); ++i) {
    if (!translucent(shapes[i])) {
      continue;
    }
    Report(progress, {"light", done++, total, shapes[i].translucency->name});
    if (reference) {
      owned_[i] = std::make_unique<ReferenceExitance>(
          world, i, indirect_, settings.kind == IntegratorSettings::Kind::kPath);
    } else {
      Illuminate(i, options, total, summary);
    }
    sources_[i] = owned_[i].get();
  }
}

void Exitances::FindSeen(const RenderOptions& options) {
  const auto& shapes = world_.scene().shapes;
  ExitanceSources looking(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (shapes[i].translucency) {
      seen_[i] = std::make_unique<SeenPlaces>(shapes[i]);
      looking[i] = seen_[i].get();
    }
  }
  TraceSeeingPaths(world_, PathTracer(world_, looking, settings_), options);
  for (const auto& seen : seen_) {
    if (seen != nullptr) {
      seen->Finish();
    }
  }
}

void Exitances::Illuminate(std::uint32_t shape,
                           const RenderOptions& options,
                           std::int64_t shape_count,
                           RenderSummary& summary) {
  const Shape& lit_shape = world_.scene().shapes[shape];
  const Stopwatch irradiance_time;
  LitPoints points =
      SampleLitPoints(world_,
                      shape,
                      indirect_,
                      {.points_per_patch = options.points_per_patch,
                       .max_points = static_cast<std::int64_t>(options.max_lit_points),
                       .seed = options.seed,
                       .thread_count = options.thread_count,
                       .ranks = options.ranks,
                       .indirect = settings_.kind == IntegratorSettings::Kind::kPath,
                       .seen = seen_[shape].get()});
  summary.irradiance_s += irradiance_time.Seconds();
  summary.lit_points += std::ssize(points.points);
  summary.lit_points_skipped += points.skipped;
  summary.lit_points_capped = summary.lit_points_capped || points.capped;
  summary.rays += points.counters.rays;
  summary.shadow_rays += points.counters.shadow_rays;
  const Stopwatch model_time;
  const SubsurfaceModel& model = *lit_shape.translucency->model;
  const bool is_weighed = !points.capped;  // too few points show too much near each
  if (is_weighed) {
    energy_.Enter(lit_shape.translucency->name, points.points, shape_count);
  }
  auto subsurface = model.Illuminate(std::move(points.points), options.thread_count);
  if (is_weighed) {
    energy_.SetModel(*subsurface);
  }
  owned_[shape] = std::make_unique<ExitanceField>(
      lit_shape,
      std::move(subsurface),
      static_cast<float>(options.exitance_spacing) * model.ExitanceSpacingMm(),
      model.PatchSizeMm());
  summary.models_s += model_time.Seconds();
}

void Exitances::AddUse(ModelUse& use) const {
  use.channels = 0;
  for (const Shape& shape : world_.scene().shapes) {
    if (shape.translucency) {
      const ModelUse of_shape = shape.translucency->model->Use();
      use.windows += of_shape.windows;
      use.windows_total += of_shape.windows_total;
      use.tiles += of_shape.tiles;
      use.tiles_total += of_shape.tiles_total;
      use.channels = std::max(use.channels, of_shape.channels);
      use.terms += of_shape.terms;
      use.terms_total += of_shape.terms_total;
    }
  }
}

}  // namespace nacre::render

#include "render/render.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/ranks.h"
#include "render/exitances.h"
#include "render/integrators/path.h"
#include "render/passes.h"
#include "render/sample_plan.h"
#include "render/stopwatch.h"
#include "render/world.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <vector>

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

int SamplesAtMost(const Scene& scene, const RenderOptions& options) {
  constexpr int kEnough = 65536;
  return options.spp > 0            ? options.spp
         : options.error_target > 0 ? kEnough
                                    : scene.samples_per_pixel;
}

void DescribeSamples(const Accumulator& film, RenderSummary& summary) {
  const auto pixels = static_cast<std::int64_t>(film.PixelCount());
  summary.samples_per_pixel = static_cast<int>(film.SamplesMade() / pixels);
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
  const Ranks alone;
  const Ranks& ranks = options.ranks == nullptr ? alone : *options.ranks;
  const Stopwatch total;
  const CpuStopwatch cpu;
  Rendering rendering;
  RenderSummary& summary = rendering.summary;
  summary.thread_count_used = ThreadCount(options.thread_count);
  const bool keep = !checkpoint.path.empty();
  Accumulator film(scene.film);
  std::vector<int> unfinished;
  if (keep && ranks.IsRoot() && ReadCheckpoint(checkpoint, film, unfinished)) {
    summary.samples_resumed = static_cast<int>(
        film.SamplesMade() / static_cast<std::int64_t>(film.PixelCount()));
  }

  const World world(scene, options.thread_count);
  summary.build_s = total.Seconds();
  DescribeScene(scene, world, summary);
  const Exitances exitances(world, settings, options, progress, summary);

  PathTracer tracer(world, exitances.sources(), settings);
  const SamplePlan plan(scene.film,
                        {.spp = SamplesAtMost(scene, options),
                         .error_target = options.error_target,
                         .sampling = ChooseSampling(settings, options)});
  Passes passes(scene, options, plan, tracer, film);
  if (settings.photons.enabled) {
    passes.UseCaustics(world, settings);
  }
  if (!ranks.IsRoot()) {
    passes.ServeRoot();
    return rendering;
  }
  passes.Run(unfinished, total.Seconds(), {progress, snapshot, checkpoint}, summary);
  DescribeSamples(film, summary);
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

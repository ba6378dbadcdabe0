#pragma once

#include "core/exr.h"
#include "core/json.h"
#include "core/json_fwd.h"
#include "core/options.h"
#include "core/progress.h"
#include "render/checkpoint.h"
#include "render/invariants.h"
#include "render/scene.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::render {

struct RenderOptions {
  int spp = 0;
  std::string integrator = "scene";
  std::uint64_t seed = 1;
  int thread_count = 0;
  double time_limit_s = 0;
  double error_target = 0;
  std::string sampling = "auto";
  bool aovs = false;
  double clamp = 0;
  double points_per_patch = 16;
  double max_lit_points = 2e6;
  double exitance_spacing = 1;
  bool lazy = true;
  double snapshot_s = 0;
  /// Among whom the work is shared; null: nobody. All ranks call Render with the same
  /// scene and options; the picture is the root's, others get a black one.
  const Ranks* ranks = nullptr;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("spp", self.spp, Range{0, 1 << 24}, "samples a pixel; 0: the scene's");
    visit("integrator",
          self.integrator,
          Range{},
          "scene (what the file says), path, direct, fast: path tracing with "
          "translucency gathered from lit points; sppm: the same with caustics by "
          "photons; reference: as fast without bias, every sample looking for light of "
          "its own");
    visit("time_limit",
          self.time_limit_s,
          Range{0, 1e9},
          "seconds after which no further pass is started; 0: none");
    visit("error_target",
          self.error_target,
          Range{0, 1e3},
          "relative L2 error at which to stop, estimated from the samples' variance; "
          "0: none. Without --spp up to 65536 samples a pixel are made");
    visit(
        "sampling",
        self.sampling,
        Range{},
        "even: --spp samples in each pixel; adaptive: more where the picture is "
        "noisier, --spp on average or as many as --error-target takes; auto: adaptive "
        "until the error is that of --spp even samples (sppm and reference: even)");
    visit("aovs",
          self.aovs,
          Range{},
          "add parts \"variance\" (of a pixel's mean luminance) and \"samples\" (their "
          "number) to the picture");
    visit("clamp",
          self.clamp,
          Range{0, 1e30},
          "upper bound of a sample's radiance, against fireflies; biased; 0: none");
    visit("points_per_patch",
          self.points_per_patch,
          Range{1, 64},
          "lit points a patch of a translucent surface");
    visit("max_lit_points",
          self.max_lit_points,
          Range{1, 1e9},
          "lit points a translucent object, at most");
    visit("exitance_spacing",
          self.exitance_spacing,
          Range{0, 64},
          "distance of the points where a translucent surface's exitance is evaluated, "
          "with interpolation between, in what its model asks for; 0: at every hit");
    visit("lazy",
          self.lazy,
          Range{},
          "find light closely only near what the picture shows");
    visit("snapshot",
          self.snapshot_s,
          Range{0, 1e9},
          "seconds between partial pictures; 0: none");
  }
};

/// What was done, and what it cost. Seconds are of the wall.
struct RenderSummary {
  int width = 0;
  int height = 0;
  int samples_per_pixel =
      0;                  ///< made, on average; fewer than asked for if time ran out
  int samples_least = 0;  ///< of any pixel
  int samples_most = 0;
  int samples_resumed = 0;  ///< of the average, from a checkpoint
  int thread_count_used = 0;
  bool time_ran_out = false;
  std::vector<std::string> ranks_lost;  ///< what stopped them; others did their work
  double relative_error = 0;  ///< of the luminance, as Accumulator estimates it
  std::int64_t triangles = 0;
  std::int64_t lights = 0;
  std::int64_t lit_points = 0;
  std::int64_t lit_points_skipped = 0;  ///< far from what is seen
  bool lit_points_capped = false;       ///< max_lit_points was too few
  std::int64_t rays = 0;
  std::int64_t shadow_rays = 0;
  std::int64_t exitances = 0;    ///< hits of translucent surfaces
  std::int64_t evaluations = 0;  ///< questions to their models; about, since threads
                                 ///< may ask the same at once
  std::int64_t pairs = 0;        ///< sources, patches or clusters, that these asked
  std::int64_t probes = 0;       ///< lines that looked for places of entry (reference)
  std::int64_t probes_cut = 0;   ///< of them, stopped after too many surfaces
  ModelUse use;                  ///< of measured materials, all together
  std::int64_t bad_samples = 0;  ///< NaN or infinite: left out
  std::int64_t clamped_samples = 0;
  Invariants invariants;    ///< checked at the end
  double build_s = 0;       ///< the ray tracer's tree
  double seen_s = 0;        ///< finding what the camera sees
  double irradiance_s = 0;  ///< light entering translucent objects
  double models_s = 0;      ///< preparing their models
  double paths_s = 0;
  double cpu_s = 0;  ///< of the process, all threads

  std::string Brief() const;  ///< one line
  std::string Table() const;  ///< some lines, for --stats
  Json ToJson() const;
};

struct Rendering {
  ExrPart image;              ///< linear; channels R, G, B (, A) or Y (, A)
  std::vector<ExrPart> aovs;  ///< "variance", "samples", if wanted
  RenderSummary summary;
};

/// Called between passes with the picture so far.
using SnapshotFunction = std::function<void(const ExrPart&)>;

/// The same scene, options and seed give the same bits for any number of threads and
/// ranks (unless a time limit cuts the work short), and whether or not the work was
/// interrupted and taken up again: with a `checkpoint`, the samples are kept there from
/// time to time, when `progress` asks to stop, and at the end, and those found there
/// are gone on from.
Rendering Render(const Scene& scene,
                 const RenderOptions& options = {},
                 const ProgressFunction& progress = {},
                 const SnapshotFunction& snapshot = {},
                 const Checkpoint& checkpoint = {});

}  // namespace nacre::render

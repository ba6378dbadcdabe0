#include "render/passes.h"

#include "core/error.h"
#include "core/ranks.h"

#include <algorithm>
#include <charconv>
#include <fmt/format.h>
#include <string>

namespace nacre::render {
namespace {

const Ranks& RanksOf(const RenderOptions& options) {
  static const Ranks alone;
  return options.ranks == nullptr ? alone : *options.ranks;
}

bool IsDue(double every_s, Stopwatch& since) {
  if (every_s <= 0 || since.Seconds() < every_s) {
    return false;
  }
  since = Stopwatch();
  return true;
}

}  // namespace

Passes::Passes(const Scene& scene,
               const RenderOptions& options,
               const SamplePlan& plan,
               PathTracer& tracer,
               Accumulator& film)
    : options_(options),
      plan_(plan),
      tracer_(tracer),
      film_(film),
      tiles_(scene, tracer, {options.seed, options.clamp}, plan, film),
      queue_(RanksOf(options), options.thread_count) {}

void Passes::UseCaustics(const World& world, const IntegratorSettings& settings) {
  caustics_.emplace(world, settings.photons, settings.max_depth);
}

void Passes::MakeMap(std::int64_t sample) {
  photons_ = caustics_->Map(sample, options_.seed, options_.thread_count);
  tracer_.UsePhotons(&photons_);
}

// Whether that many more samples still fit, judged by those made since the start.
bool Passes::TimeLeft(std::int64_t samples) const {
  if (options_.time_limit_s <= 0 || counters_.samples == 0) {
    return true;
  }
  const double share =
      static_cast<double>(samples) / static_cast<double>(counters_.samples);
  return seconds_before_ + watch_.Seconds() * (1 + share) <= options_.time_limit_s;
}

void Passes::Note(const TileCounters& counters, const PassOutlets& outlets) {
  const std::lock_guard lock(note_mutex_);
  counters_ += counters;
  Report(outlets.progress,
         {"render", made_before_ + counters_.samples, plan_.SamplesAtMost(), ""});
}

void Passes::KeepIfDue(const std::vector<int>& pass, const PassOutlets& outlets) {
  constexpr double kEvery = 10;
  if (!outlets.checkpoint.path.empty() && IsDue(kEvery, since_checkpoint_)) {
    WriteCheckpoint(outlets.checkpoint, film_, pass);
  }
}

void Passes::RunPass(const std::vector<int>& pass, const PassOutlets& outlets) {
  std::vector<std::int64_t> tiles;
  for (std::int64_t tile = 0; tile < plan_.TileCount(); ++tile) {
    if (!tiles_.IsDone(tile, pass[static_cast<std::size_t>(tile)])) {
      tiles.push_back(tile);
    }
  }
  const auto tile_of = [&](std::int64_t job) {
    return tiles[static_cast<std::size_t>(job)];
  };
  const auto up_to = [&](std::int64_t job) {
    return pass[static_cast<std::size_t>(tile_of(job))];
  };
  queue_.Run(
      {.count = std::ssize(tiles),
       .describe =
           [&](std::int64_t job) { return tiles_.Describe(tile_of(job), up_to(job)); },
       .here =
           [&](std::int64_t job) {
             Note(tiles_.Trace(tile_of(job), up_to(job)), outlets);
           },
       .take =
           [&](std::int64_t job, std::string_view result) {
             Note(tiles_.TakeResult(tile_of(job), result), outlets);
           },
       .between =
           [&] {
             Note({}, outlets);  // whoever wants it to stop waits for nobody
             KeepIfDue(pass, outlets);
           }});
}

void Passes::Run(const std::vector<int>& unfinished,
                 double seconds_before,
                 const PassOutlets& outlets,
                 RenderSummary& summary) {
  watch_ = since_snapshot_ = since_checkpoint_ = Stopwatch();
  seconds_before_ = seconds_before;
  Expect(unfinished.empty() || std::ssize(unfinished) == plan_.TileCount(),
         "a pass of this picture");
  made_before_ = film_.SamplesMade();
  const bool keep = !outlets.checkpoint.path.empty();
  const auto next = [&] {
    std::vector<int> pass = plan_.Next(film_);
    if (caustics_) {  // a map for each sample of the pixels
      std::fill(pass.begin(), pass.end(), static_cast<int>(film_.SamplesMade(0)) + 1);
    }
    return pass;
  };
  for (std::vector<int> pass = unfinished.empty() ? next() : unfinished; !pass.empty();
       pass = next()) {
    if (!TimeLeft(plan_.SamplesUpTo(pass) - film_.SamplesMade())) {
      summary.time_ran_out = true;
      break;
    }
    if (caustics_) {
      queue_.Announce(std::to_string(pass[0] - 1));
      MakeMap(pass[0] - 1);
    }
    try {
      RunPass(pass, outlets);
    } catch (const Error& error) {
      if (error.code() != ExitCode::kInterrupted || !keep) {
        throw;
      }
      WriteCheckpoint(outlets.checkpoint, film_, pass);
      throw Interrupted(
          fmt::format("{}; its samples are kept in {}: the same command goes on",
                      error.what(),
                      outlets.checkpoint.path.string()));
    }
    if (outlets.snapshot && IsDue(options_.snapshot_s, since_snapshot_)) {
      outlets.snapshot(film_.ToImage());
    }
  }
  queue_.Finish();
  if (keep) {
    WriteCheckpoint(outlets.checkpoint, film_);
  }
  summary.rays += counters_.paths.rays;
  summary.shadow_rays += counters_.paths.shadow_rays;
  summary.exitances += counters_.paths.exitances;
  summary.evaluations += counters_.paths.evaluations;
  summary.pairs += counters_.paths.pairs;
  summary.probes += counters_.paths.probes;
  summary.probes_cut += counters_.paths.probes_cut;
  summary.bad_samples += counters_.bad;
  summary.clamped_samples += counters_.clamped;
  summary.ranks_lost = queue_.lost();
  summary.paths_s = watch_.Seconds();
}

void Passes::ServeRoot() {
  queue_.Serve(
      [&](std::string_view announced) {
        std::int64_t sample = 0;
        std::from_chars(announced.data(), announced.data() + announced.size(), sample);
        MakeMap(sample);
      },
      [&](std::string_view tile) { return tiles_.TraceDescribed(tile); });
}

}  // namespace nacre::render

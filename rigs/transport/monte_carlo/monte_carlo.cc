#include "rigs/transport/monte_carlo/monte_carlo.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/ranks.h"
#include "rigs/transport/monte_carlo/internal/packet.h"
#include "rigs/transport/monte_carlo/symmetry.h"
#include "rigs/transport/monte_carlo/tally.h"

#include <algorithm>
#include <ctime>
#include <fmt/format.h>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

// Long enough for full lanes, short enough for progress.
constexpr std::int64_t kBlock = 1 << 16;

void Validate(const TallyRequest& request) {
  const bool good = request.window_core >= 0 && request.ring_count >= 0 &&
                    request.cosine_count >= 0 && request.depth_count >= 0 &&
                    (request.window_core == 0 || request.window_pitch_mm > 0) &&
                    (request.ring_count == 0 || request.ring_width_mm > 0) &&
                    (request.depth_count == 0 || request.depth_step_mm > 0);
  if (!good) {
    throw UsageError(fmt::format(
        "Monte Carlo: tables of {}² cells of {} mm, {} rings of {} mm, {} "
        "cosines, {} depths of {} mm; no count may be negative, and what is "
        "counted needs a size greater than 0",
        request.window_core,
        request.window_pitch_mm,
        request.ring_count,
        request.ring_width_mm,
        request.cosine_count,
        request.depth_count,
        request.depth_step_mm));
  }
}

double ThreadCpuSeconds() {
  timespec now{};
  if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) != 0) {
    throw SystemError("reading the thread's CPU clock");
  }
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Blocks small enough to keep the threads busy until the end. The result doesn't depend
// on it, since a photon's numbers are its own and counts are integers.
std::int64_t BlockSize(std::int64_t photon_count, int thread_count) {
  std::int64_t block = kBlock;
  while (block > 1024 && block * 4 * ThreadCount(thread_count) > photon_count) {
    block /= 2;
  }
  return block;
}

}  // namespace

struct Simulation::State {
  State(const Volume& volume_in,
        const Source& source,
        const TallyRequest& request_in,
        const Options& options)
      : volume(volume_in),
        request(request_in),
        job{.packet_volume = internal::MakePacketVolume(volume),
            .volume = &volume,
            .source = source,
            .seed = static_cast<std::uint64_t>(options.seed)},
        total(request, volume.media.size()),
        thread_count(options.thread_count),
        ranks(options.ranks) {}

  Volume volume;
  TallyRequest request;
  internal::PacketJob job;
  CountTally total;
  int thread_count;
  const Ranks* ranks;
  std::int64_t photon_count = 0;
  double cpu_seconds = 0;

  void Follow(std::int64_t first,
              std::int64_t last,
              const ProgressFunction& progress,
              CountTally& result);
};

// Photons number `first` to before `last`, on all threads of this rank.
void Simulation::State::Follow(std::int64_t first,
                               std::int64_t last,
                               const ProgressFunction& progress,
                               CountTally& result) {
  std::int64_t done = first;
  // As many tallies as threads: a window may be large.
  std::vector<std::unique_ptr<CountTally>> idle;
  std::mutex mutex;
  const auto take = [&]() -> std::unique_ptr<CountTally> {
    const std::lock_guard<std::mutex> lock(mutex);
    if (idle.empty()) {
      return std::make_unique<CountTally>(request, volume.media.size());
    }
    std::unique_ptr<CountTally> tally = std::move(idle.back());
    idle.pop_back();
    return tally;
  };
  ParallelForBlocks(last - first,
                    BlockSize(last - first, thread_count),
                    thread_count,
                    [&](std::int64_t begin, std::int64_t end) {
                      std::unique_ptr<CountTally> tally = take();
                      const double start = ThreadCpuSeconds();
                      internal::RunPhotons(job, first + begin, first + end, *tally);
                      const double seconds = ThreadCpuSeconds() - start;
                      const std::lock_guard<std::mutex> lock(mutex);
                      idle.push_back(std::move(tally));
                      cpu_seconds += seconds;
                      done += end - begin;
                      Report(progress, {"monte carlo", done, last, "photons"});
                    });
  for (const std::unique_ptr<CountTally>& tally : idle) {
    result.Merge(*tally);
  }
}

Simulation::Simulation(const Volume& volume,
                       const Source& source,
                       const TallyRequest& request,
                       const Options& options) {
  Validate(volume);
  Validate(source);
  Validate(request);
  nacre::Validate(options);
  state_ = std::make_unique<State>(volume, source, request, options);
}

Simulation::~Simulation() = default;

void Simulation::Add(std::int64_t photon_count, const ProgressFunction& progress) {
  State& s = *state_;
  // The photons are numbered through, so that it doesn't matter who follows which.
  const RankShare share = ShareOf(photon_count, s.ranks);
  CountTally added(s.request, s.volume.media.size());
  s.Follow(s.photon_count + share.begin, s.photon_count + share.end, progress, added);
  if (s.ranks != nullptr && s.ranks->size() > 1) {
    std::vector<std::int64_t> counts = added.Counts();
    s.ranks->Sum(counts);
    added.SetCounts(counts);
  }
  s.total.Merge(added);
  s.photon_count += photon_count;
}

Result Simulation::Get() const {
  const State& s = *state_;
  Expect(s.photon_count > 0, "at least one photon");
  Result result = s.total.ToResult(s.photon_count);
  result.specular = SpecularReflectance(s.job.source, s.volume);
  if (s.request.use_symmetry && s.request.window_centre.x == s.job.source.centre.x &&
      s.request.window_centre.y == s.job.source.centre.y) {
    AverageImages(Symmetries(s.volume, s.job.source), s.request, result);
  }
  result.cpu_seconds = s.cpu_seconds;
  return result;
}

Result Simulate(const Volume& volume,
                const Source& source,
                const TallyRequest& request,
                const Options& options,
                const ProgressFunction& progress) {
  Simulation simulation(volume, source, request, options);
  simulation.Add(options.photon_count, progress);
  return simulation.Get();
}

std::vector<std::string> InstructionSets() {
  return internal::SupportedInstructionSets();
}

void UseInstructionSet(const std::string& name) {
  internal::ChooseInstructionSet(name);
}

}  // namespace nacre::rigs::monte_carlo

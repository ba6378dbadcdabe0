#include "rigs/transport/monte_carlo/monte_carlo.h"

#include "core/error.h"
#include "core/parallel.h"
#include "rigs/transport/monte_carlo/internal/packet.h"
#include "rigs/transport/monte_carlo/symmetry.h"
#include "rigs/transport/monte_carlo/tally.h"

#include <algorithm>
#include <ctime>
#include <fmt/format.h>
#include <mutex>

namespace nacre::rigs::monte_carlo {
namespace {

// Long enough for full lanes, short enough for progress; a power of two, so that no
// block straddles a multiple of 2³².
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

Result Simulate(const Volume& volume,
                const Source& source,
                const TallyRequest& request,
                const Options& options,
                const ProgressFunction& progress) {
  Validate(volume);
  Validate(source);
  Validate(request);
  nacre::Validate(options);
  const internal::PacketJob job{.packet_volume = internal::MakePacketVolume(volume),
                                .volume = &volume,
                                .source = source,
                                .seed = static_cast<std::uint64_t>(options.seed)};
  CountTally total(request, volume.media.size());
  double cpu_seconds = 0;
  std::int64_t done = 0;
  std::mutex mutex;
  ParallelForBlocks(options.photon_count,
                    BlockSize(options.photon_count, options.thread_count),
                    options.thread_count,
                    [&](std::int64_t begin, std::int64_t end) {
                      const double start = ThreadCpuSeconds();
                      CountTally tally(request, volume.media.size());
                      internal::RunPhotons(job, begin, end, tally);
                      const double seconds = ThreadCpuSeconds() - start;
                      const std::lock_guard<std::mutex> lock(mutex);
                      total.Merge(tally);
                      cpu_seconds += seconds;
                      done += end - begin;
                      Report(progress, {"monte carlo", done, options.photon_count, ""});
                    });
  Result result = total.ToResult(options.photon_count);
  result.specular = SpecularReflectance(source, volume);
  if (request.use_symmetry && request.window_centre.x == source.centre.x &&
      request.window_centre.y == source.centre.y) {
    AverageImages(Symmetries(volume, source), request, result);
  }
  result.cpu_seconds = cpu_seconds;
  return result;
}

std::vector<std::string> InstructionSets() {
  return internal::SupportedInstructionSets();
}

void UseInstructionSet(const std::string& name) {
  internal::ChooseInstructionSet(name);
}

}  // namespace nacre::rigs::monte_carlo

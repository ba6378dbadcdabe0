// The speed of reconstruction against that of reading and decoding the same pictures
// alone, in one run:
//
//   reconstruct_speed SESSION [CALIBRATION.json] [--threads N=2] [--memory BYTES=512e6]
//                     [--runs N=3] [--cold]
//
// Each run reads all pictures of the grid, and then reconstructs; the best of each
// counts. `share` is reading's part of the reconstruction's time: 100 % if nothing else
// took any. With --cold the same once more with a cache that holds none of the
// pictures: what the system keeps of the disk is dropped before each, or, where that
// isn't allowed, file by file what it keeps of the pictures; which, is said.

#include "calibrate/calibrate.h"
#include "core/parallel.h"
#include "reconstruct/reconstruct.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <functional>
#include <string>
#include <sys/resource.h>
#include <unistd.h>

namespace nacre::reconstruct {
namespace {

struct Arguments {
  std::filesystem::path session;
  std::filesystem::path calibration;
  ReconstructOptions options{.thread_count = 2};
  int runs = 3;
  bool is_cold = false;
};

struct Times {
  double wall_s = 1e30;
  double cpu_s = 1e30;
};

double WallSeconds() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double CpuSeconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void KeepBest(const std::function<void()>& work, Times& best) {
  const double wall = WallSeconds();
  const double cpu = CpuSeconds();
  work();
  best.wall_s = std::min(best.wall_s, WallSeconds() - wall);
  best.cpu_s = std::min(best.cpu_s, CpuSeconds() - cpu);
}

// Whether the whole cache could be dropped, names of files as well.
bool DropFromCache(const acquire::SessionReader& session) {
  ::sync();
  std::FILE* drop = std::fopen("/proc/sys/vm/drop_caches", "w");
  if (drop != nullptr) {
    const bool is_dropped = std::fputs("3\n", drop) >= 0;
    if (std::fclose(drop) == 0 && is_dropped) {
      return true;
    }
  }
  for (std::int64_t n = session.schedule().grid_begin(); n < session.picture_count();
       ++n) {
    const std::filesystem::path path = session.folder() / session.Entry(n).file;
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd >= 0) {
      ::posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
      ::close(fd);
    }
  }
  return false;
}

std::int64_t ReadAll(const acquire::SessionReader& session, int thread_count) {
  const std::int64_t begin = session.schedule().grid_begin();
  const std::int64_t count = session.picture_count() - begin;
  ParallelFor(count, thread_count, [&](std::int64_t n) {
    if (session.WasTaken(begin + n)) {
      session.ReadFrame(begin + n);
    }
  });
  return count;
}

// Both, and what they have to do with each other.
void Measure(const Arguments& args,
             const acquire::SessionReader& session,
             const calibrate::Calibration& calibration,
             bool is_cold) {
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / "reconstruct_speed.rd.exr";
  Times reading;
  Times reconstructing;
  std::int64_t pictures = 0;
  ReconstructSummary summary;
  const char* cache = "warm cache";
  const auto prepare = [&] {
    if (is_cold) {
      cache = DropFromCache(session) ? "cold cache (all dropped)"
                                     : "cold cache (the pictures dropped; no right to "
                                       "/proc/sys/vm/drop_caches)";
    }
  };
  for (int run = 0; run < args.runs; ++run) {
    prepare();
    KeepBest([&] { pictures = ReadAll(session, args.options.thread_count); }, reading);
    prepare();
    KeepBest([&] { summary = Reconstruct(session, calibration, out, args.options); },
             reconstructing);
  }
  std::filesystem::remove(out);
  const auto& camera = session.manifest().camera;
  const double megapixels = 1e-6 * static_cast<double>(pictures) * camera.width *
                            static_cast<double>(camera.height);
  std::printf("%lld pictures of %d x %d pixels, %s, %d threads\n",
              static_cast<long long>(pictures),
              camera.width,
              camera.height,
              cache,
              ThreadCount(args.options.thread_count));
  for (const auto& [name, times] :
       {std::pair{"reading alone", reading}, {"reconstruct", reconstructing}}) {
    std::printf("%-14s %7.3f s, %7.3f s of CPU, %6.1f megapixels/s\n",
                name,
                times.wall_s,
                times.cpu_s,
                megapixels / times.wall_s);
  }
  std::printf("share          %6.1f %%, %6.1f %% of CPU\n%s\n",
              100 * reading.wall_s / reconstructing.wall_s,
              100 * reading.cpu_s / reconstructing.cpu_s,
              summary.Brief().c_str());
}

void Run(const Arguments& args) {
  const acquire::SessionReader session(args.session);
  const calibrate::Calibration calibration =
      args.calibration.empty() ? calibrate::Calibrate(session, {})
                               : calibrate::ReadCalibration(args.calibration);
  ReadAll(session, args.options.thread_count);
  Measure(args, session, calibration, false);
  if (args.is_cold) {
    Measure(args, session, calibration, true);
  }
}

Arguments Parse(int argc, char** argv) {
  Arguments args;
  for (int n = 1; n < argc; ++n) {
    const std::string argument = argv[n];
    const auto value = [&] { return n + 1 < argc ? std::atof(argv[++n]) : 0.0; };
    if (argument == "--threads") {
      args.options.thread_count = static_cast<int>(value());
    } else if (argument == "--memory") {
      args.options.memory_bytes = value();
    } else if (argument == "--runs") {
      args.runs = static_cast<int>(value());
    } else if (argument == "--cold") {
      args.is_cold = true;
    } else {
      (args.session.empty() ? args.session : args.calibration) = argument;
    }
  }
  return args;
}

}  // namespace
}  // namespace nacre::reconstruct

int main(int argc, char** argv) {
  try {
    nacre::reconstruct::Run(nacre::reconstruct::Parse(argc, argv));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "reconstruct_speed: %s\n", e.what());
    return 1;
  }
  return 0;
}

#include "cli/stage_clock.h"

#include <ctime>
#include <fstream>
#include <sstream>
#include <string>

namespace nacre::cli {
namespace {

double PeakMb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    std::istringstream words(line);
    std::string key;
    double kilobytes = 0;
    if (words >> key >> kilobytes && key == "VmHWM:") {
      return kilobytes / 1024;
    }
  }
  return 0;
}

}  // namespace

double CpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

StageClock::StageClock()
    : start_(std::chrono::steady_clock::now()), cpu_start_(CpuSeconds()) {
  std::ofstream("/proc/self/clear_refs") << "5";
}

StageCost StageClock::Read() const {
  return {.seconds =
              std::chrono::duration<double>(std::chrono::steady_clock::now() - start_)
                  .count(),
          .cpu_seconds = CpuSeconds() - cpu_start_,
          .peak_mb = PeakMb()};
}

}  // namespace nacre::cli

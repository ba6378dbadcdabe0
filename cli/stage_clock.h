#pragma once

#include <chrono>

namespace nacre::cli {

/// Of all threads of this process so far.
double CpuSeconds();

struct StageCost {
  double seconds = 0;      ///< of the wall
  double cpu_seconds = 0;  ///< of all threads of the process
  double peak_mb = 0;      ///< largest resident memory meanwhile; 0 where unknown
};

/// Measures from its construction on. Resets the kernel's peak of resident memory where
/// that is allowed (Linux, /proc/self/clear_refs), so only one may run at a time.
class StageClock {
 public:
  StageClock();
  StageCost Read() const;

 private:
  std::chrono::steady_clock::time_point start_;
  double cpu_start_;
};

}  // namespace nacre::cli

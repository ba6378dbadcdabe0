#pragma once

#include "acquire/capture.h"
#include "core/progress.h"

#include <cstdint>
#include <filesystem>
#include <optional>

namespace nacre::cli {

/// What to capture, and whereto.
struct CaptureRequest {
  std::filesystem::path rig;          ///< rig.toml
  std::filesystem::path out;          ///< session folder
  bool resume = false;                ///< go on with the session that is there
  bool durable = false;               ///< flush every frame to disk
  std::optional<std::uint64_t> seed;  ///< of a simulated rig, instead of its own
  int thread_count = 0;
};

struct CaptureOutcome {
  std::int64_t pictures = 0;        ///< of the session, all there
  std::int64_t pictures_taken = 0;  ///< by this run
  std::int64_t frames_lost = 0;     ///< and taken again
  std::int64_t frames_damaged = 0;  ///< on disk, found on resuming, and taken again
  double seconds = 0;
};

/// Opens the rig and takes all pictures that are missing: the calibration targets, then
/// the grid, aimed by the laser map that those give.
CaptureOutcome RunCapture(const CaptureRequest& request,
                          const ProgressFunction& progress);

}  // namespace nacre::cli

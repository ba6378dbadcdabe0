#pragma once

#include "acquire/capture.h"
#include "core/progress.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace nacre::cli {

/// What to capture, and whereto.
struct CaptureRequest {
  std::filesystem::path rig;          ///< rig.toml
  std::filesystem::path out;          ///< session folder
  bool resume = false;                ///< go on with the session that is there
  bool durable = false;               ///< flush every frame to disk
  bool dry_run = false;               ///< on the simulated rig that the file describes
  bool arm_laser = false;             ///< of a hardware rig
  std::optional<std::uint64_t> seed;  ///< of a simulated rig, instead of its own
  int thread_count = 0;
  /// If not empty: a live page is served, and this is told where.
  std::function<void(const std::string& url)> on_preview = {};
  int preview_port = 0;  ///< 0: any free one
};

struct CaptureOutcome {
  std::int64_t pictures = 0;           ///< of the session, all there
  std::int64_t pictures_taken = 0;     ///< by this run
  std::int64_t pictures_left_out = 0;  ///< by this run, being adaptive
  std::int64_t frames_lost = 0;        ///< and taken again
  std::int64_t light_failures = 0;     ///< pictures taken again since the light failed
  std::int64_t waits_for_disk = 0;     ///< of the camera
  std::int64_t frames_damaged = 0;     ///< on disk, found on resuming, and taken again
  double seconds = 0;
};

/// Opens the rig and takes all pictures that are missing: the calibration targets, then
/// the grid, aimed by the laser map that those give.
CaptureOutcome RunCapture(const CaptureRequest& request,
                          const ProgressFunction& progress);

}  // namespace nacre::cli

#pragma once

#include "acquire/camera.h"
#include "acquire/rig.h"
#include "acquire/schedule.h"
#include "core/progress.h"

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

namespace nacre::cli::preview {

/// What a person at the rig wants to see of a capture under way. Told by the capture,
/// asked by the web page; both from any thread. Keeps the last frame and nothing else
/// that grows; frames are turned into pictures when somebody asks.
class Monitor {
 public:
  Monitor(const acquire::RigDescription& rig, const acquire::CameraInfo& camera);

  /// A frame that is in the session now.
  void OnFrame(std::int64_t number, std::shared_ptr<const acquire::Frame> frame);
  void OnProgress(const Progress& progress);
  /// The last word: "done", or what went wrong.
  void OnEnd(const std::string& message);
  /// Whether somebody looked just now and hasn't heard it yet.
  bool IsLastWordAwaited() const;

  /// One JSON object: what is taken, how far it is, when it will be done, the last
  /// picture's exposure, share of saturated pixels and histogram, faults so far.
  std::string StateJson() const;

  /// The last frame's picture (frame_png.h), empty before there is one.
  std::string FramePng(int max_side_px) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Last {
    std::int64_t number = -1;
    std::shared_ptr<const acquire::Frame> frame;
  };
  Last LastFrame() const;

  const acquire::RigDescription rig_;
  const acquire::Schedule schedule_;
  const acquire::CameraInfo camera_;
  const Clock::time_point start_ = Clock::now();

  mutable std::mutex mutex_;  // of all below
  Last last_;
  Progress progress_;
  std::int64_t first_done_ = -1;  // of the stage, when this run began with it
  Clock::time_point stage_start_;
  std::int64_t frames_ = 0;
  std::int64_t retaken_ = 0;
  std::uint64_t resent_packets_ = 0;
  std::string end_;
  mutable bool end_told_ = false;
  mutable Clock::time_point asked_{};
};

}  // namespace nacre::cli::preview

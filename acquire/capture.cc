#include "acquire/capture.h"

#include "acquire/internal/frame_queue.h"
#include "acquire/internal/rig_state.h"
#include "core/error.h"

#include <algorithm>
#include <chrono>

namespace nacre::acquire {
namespace {

std::size_t QueuedFrames(const CameraInfo& camera, const CaptureOptions& options) {
  const std::size_t frame_bytes = 2 * static_cast<std::size_t>(camera.width) *
                                  static_cast<std::size_t>(camera.height) *
                                  static_cast<std::size_t>(camera.SamplesPerPixel());
  return std::max<std::size_t>(
      4, options.queue_bytes / std::max<std::size_t>(1, frame_bytes));
}

// One run from the first missing picture up to `end`.
class Run {
 public:
  Run(SessionWriter& session,
      const Devices& devices,
      const ScanMap* map,
      const ProgressFunction& progress,
      const CaptureOptions& options)
      : session_(session),
        progress_(progress),
        options_(options),
        stage_(map == nullptr ? "targets" : "capture"),
        queue_(session,
               QueuedFrames(session.manifest().camera, options),
               options.on_frame),
        state_(session, devices, map) {}

  void TakeUntil(std::int64_t end) {
    for (std::int64_t number = session_.picture_count(); number < end; ++number) {
      const ScheduledPicture& picture = session_.schedule()[number];
      const std::string skipped = WhyNot(number);
      if (skipped.empty()) {
        queue_.Push(state_.Take(number, summary_));
        ++summary_.pictures_taken;
      } else {
        queue_.PushSkip(skipped);
        ++summary_.pictures_skipped;
      }
      Report(progress_,
             {.stage = stage_,
              .done = number + 1,
              .total = session_.schedule().size(),
              .note = Name(picture.target)});
    }
  }

  CaptureSummary Finish() {
    queue_.Finish();
    summary_.waits_for_disk = queue_.times_full();
    return summary_;
  }

 private:
  // Why an adaptive capture needn't take the next picture.
  std::string WhyNot(std::int64_t number) {
    if (!session_.rig().adaptive || session_.schedule()[number].group < 1) {
      return "";  // the first group is the preview
    }
    const auto settle = [this] { queue_.WaitUntilWritten(); };
    if (!session_.manifest().adaptive_plan) {
      settle();
      session_.SetAdaptivePlan(PlanFromPreview(SessionReader(session_.folder()),
                                               options_.pixel_from_sample));
    }
    return WhySkip(session_, number, settle);
  }

  SessionWriter& session_;
  const ProgressFunction& progress_;
  const CaptureOptions& options_;
  const std::string stage_;
  CaptureSummary summary_;
  internal::FrameQueue queue_;
  internal::RigState
      state_;  // last, so that the laser is dark before the queue runs empty
};

CaptureSummary Capture(SessionWriter& session,
                       const Devices& devices,
                       std::int64_t end,
                       const ScanMap* map,
                       const ProgressFunction& progress,
                       const CaptureOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  CaptureSummary summary;
  if (session.picture_count() < end) {
    Run run(session, devices, map, progress, options);
    run.TakeUntil(end);
    devices.illuminator.Blank();
    summary = run.Finish();
  }
  summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace

CaptureSummary CaptureCalibration(SessionWriter& session,
                                  const Devices& devices,
                                  const ProgressFunction& progress,
                                  const CaptureOptions& options) {
  return Capture(
      session, devices, session.schedule().grid_begin(), nullptr, progress, options);
}

CaptureSummary CaptureGrid(SessionWriter& session,
                           const Devices& devices,
                           const ScanMap& map,
                           const ProgressFunction& progress,
                           const CaptureOptions& options) {
  Expect(session.picture_count() >= session.schedule().grid_begin(),
         "the calibration pictures come first");
  session.SetScanMap(map);
  return Capture(session, devices, session.schedule().size(), &map, progress, options);
}

CapturePlan PlanCapture(const RigDescription& rig, const CameraInfo& camera) {
  const Schedule schedule(rig);
  CapturePlan plan;
  plan.target_pictures = schedule.grid_begin();
  plan.grid_pictures = schedule.size() - schedule.grid_begin();
  plan.spot_groups = schedule.group_count();
  for (int group = 0; group < schedule.group_count(); ++group) {
    plan.grid_points += std::ssize(schedule.Group(group));
  }
  for (std::int64_t number = 0; number < schedule.size(); ++number) {
    plan.exposure_seconds += schedule[number].exposure_us * 1e-6;
  }
  constexpr std::uint64_t kHeaderAndLine = 400;
  plan.disk_bytes = static_cast<std::uint64_t>(schedule.size()) *
                    (static_cast<std::uint64_t>(camera.width) *
                         static_cast<std::uint64_t>(camera.height) * 2 *
                         static_cast<std::uint64_t>(camera.SamplesPerPixel()) +
                     kHeaderAndLine);
  return plan;
}

}  // namespace nacre::acquire

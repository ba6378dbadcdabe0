#include "acquire/capture.h"

#include "acquire/internal/frame_queue.h"
#include "core/error.h"

#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <vector>

namespace nacre::acquire {
namespace {

constexpr int kAttempts = 4;  // a lost frame is asked for three times again
constexpr std::size_t kQueuedFrames = 4;
constexpr std::chrono::seconds kTimeoutBeyondExposure{5};

// Leaves the laser dark however the capture ends.
class BlankOnExit {
 public:
  explicit BlankOnExit(Illuminator& illuminator) : illuminator_(illuminator) {}
  ~BlankOnExit() { illuminator_.Blank(); }
  BlankOnExit(const BlankOnExit&) = delete;
  BlankOnExit& operator=(const BlankOnExit&) = delete;

 private:
  Illuminator& illuminator_;
};

// Brings the rig into the state that a picture asks for, changing only what differs.
class RigState {
 public:
  RigState(const SessionWriter& session, const Devices& devices, const ScanMap* map)
      : session_(session), devices_(devices), map_(map) {}

  // Returns the exposure that the camera applies.
  double Set(const ScheduledPicture& picture) {
    if (!known_ || last_.target != picture.target || last_.pose != picture.pose) {
      devices_.illuminator.Blank();  // whoever reaches into the rig meets no beam
      known_ = false;
      devices_.stage.Place(picture.target, picture.pose);
      SetLight(picture);
    } else if (last_.channel != picture.channel || last_.group != picture.group) {
      SetLight(picture);
    }
    if (!known_ || last_.exposure_us != picture.exposure_us) {
      applied_exposure_us_ = devices_.camera.SetExposureUs(picture.exposure_us);
    }
    last_ = picture;
    known_ = true;
    return applied_exposure_us_;
  }

 private:
  void SetLight(const ScheduledPicture& picture) {
    if (picture.channel < 0) {
      devices_.illuminator.Blank();
    } else if (picture.group < 0) {
      devices_.illuminator.Light(session_.schedule().lattice(), picture.channel);
    } else {
      std::vector<ScanAngle> spots;
      for (const GridIndex index : session_.schedule().Group(picture.group)) {
        spots.push_back(
            map_->AngleFromSample(session_.rig().grid.Point(index.i, index.j)));
      }
      devices_.illuminator.Light(spots, picture.channel);
    }
  }

  const SessionWriter& session_;
  const Devices& devices_;
  const ScanMap* map_;
  ScheduledPicture last_;
  bool known_ = false;  // whether last_ is what the rig is in
  double applied_exposure_us_ = 0;
};

Frame TakePicture(Camera& camera,
                  std::int64_t number,
                  double exposure_us,
                  std::int64_t& frames_lost) {
  const auto timeout =
      kTimeoutBeyondExposure +
      std::chrono::milliseconds(static_cast<std::int64_t>(exposure_us / 1000));
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (auto frame = camera.Capture(static_cast<std::uint64_t>(number), timeout)) {
      frame->exposure_us = exposure_us;
      return std::move(*frame);
    }
    ++frames_lost;
  }
  throw DeviceError(fmt::format(
      "picture {}: the camera lost the frame {} times; see to its cable and its host's "
      "load, then resume the capture",
      number,
      kAttempts));
}

// Takes pictures up to `end`; `map` aims at the sample.
CaptureSummary Capture(SessionWriter& session,
                       const Devices& devices,
                       std::int64_t end,
                       const ScanMap* map,
                       const ProgressFunction& progress) {
  const auto start = std::chrono::steady_clock::now();
  const std::int64_t begin = session.picture_count();
  const std::string stage = map == nullptr ? "targets" : "capture";
  CaptureSummary summary;
  if (begin < end) {
    internal::FrameQueue queue(session, kQueuedFrames);
    const BlankOnExit blank(devices.illuminator);  // before the queue runs empty
    RigState state(session, devices, map);
    for (std::int64_t number = begin; number < end; ++number) {
      const ScheduledPicture& picture = session.schedule()[number];
      const double exposure_us = state.Set(picture);
      queue.Push(TakePicture(devices.camera, number, exposure_us, summary.frames_lost));
      ++summary.pictures_taken;
      Report(progress,
             {.stage = stage,
              .done = number + 1,
              .total = session.schedule().size(),
              .note = Name(picture.target)});
    }
    devices.illuminator.Blank();
    queue.Finish();
  }
  summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace

CaptureSummary CaptureCalibration(SessionWriter& session,
                                  const Devices& devices,
                                  const ProgressFunction& progress) {
  return Capture(session, devices, session.schedule().grid_begin(), nullptr, progress);
}

CaptureSummary CaptureGrid(SessionWriter& session,
                           const Devices& devices,
                           const ScanMap& map,
                           const ProgressFunction& progress) {
  Expect(session.picture_count() >= session.schedule().grid_begin(),
         "the calibration pictures come first");
  session.SetScanMap(map);
  return Capture(session, devices, session.schedule().size(), &map, progress);
}

CapturePlan PlanCapture(const RigDescription& rig, const CameraInfo& camera) {
  const Schedule schedule(rig);
  CapturePlan plan;
  plan.target_pictures = schedule.grid_begin();
  plan.grid_pictures = schedule.size() - schedule.grid_begin();
  plan.spot_groups = schedule.group_count();
  for (std::int64_t number = 0; number < schedule.size(); ++number) {
    plan.exposure_seconds += schedule[number].exposure_us * 1e-6;
  }
  constexpr std::uint64_t kHeaderAndLine = 400;
  plan.disk_bytes = static_cast<std::uint64_t>(schedule.size()) *
                    (static_cast<std::uint64_t>(camera.width) *
                         static_cast<std::uint64_t>(camera.height) * 2 +
                     kHeaderAndLine);
  return plan;
}

}  // namespace nacre::acquire

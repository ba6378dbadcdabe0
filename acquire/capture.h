#pragma once

#include "acquire/adaptive.h"
#include "acquire/camera.h"
#include "acquire/illuminator.h"
#include "acquire/sample_stage.h"
#include "acquire/session_writer.h"
#include "core/progress.h"

#include <cstdint>
#include <functional>
#include <memory>

namespace nacre::acquire {

/// The parts of a rig.
struct Devices {
  Camera& camera;
  Illuminator& illuminator;
  SampleStage& stage;
};

/// A whole frame that is in the session now. Called on the writer's thread.
using FrameFunction =
    std::function<void(std::int64_t number, const std::shared_ptr<const Frame>& frame)>;

struct CaptureOptions {
  /// Memory for frames that wait for the disk, at least four.
  std::size_t queue_bytes = std::size_t{512} << 20;
  FrameFunction on_frame = {};
  /// Where the camera sees the sample, for [adaptive] skip_empty.
  PixelFromSample pixel_from_sample = {};
};

struct CaptureSummary {
  std::int64_t pictures_taken = 0;    ///< by this call
  std::int64_t pictures_skipped = 0;  ///< by this call, see [adaptive]
  std::int64_t frames_lost = 0;       ///< and asked for again
  std::int64_t light_failures = 0;    ///< frames taken again since the light failed
  std::int64_t waits_for_disk = 0;    ///< of the camera: the queue was full
  double seconds = 0;
};

/// Takes the pictures before the sample's that are still missing: dark frames,
/// checkerboard, flat pairs, laser lattice.
///
/// Both calls: expose the next picture while the last is unpacked, checked, written and
/// shown; ask three times again for a lost frame before they give up with a
/// DeviceError; blank the laser while the camera is away, and leave it dark however
/// they end. If `progress` answers false they finish the picture in flight and throw
/// Interrupted; the session can be resumed then, as after any error or kill, and ends
/// up with the same bits.
CaptureSummary CaptureCalibration(SessionWriter& session,
                                  const Devices& devices,
                                  const ProgressFunction& progress = {},
                                  const CaptureOptions& options = {});

/// Takes the pictures of the sample that are still missing, the laser aimed by `map`,
/// which is noted in the manifest. Requires that the calibration pictures are there. If
/// the rig has [adaptive], the first group of spots is the preview that decides on the
/// rest, see acquire/adaptive.h.
CaptureSummary CaptureGrid(SessionWriter& session,
                           const Devices& devices,
                           const ScanMap& map,
                           const ProgressFunction& progress = {},
                           const CaptureOptions& options = {});

/// What a capture will take, for `--plan`.
struct CapturePlan {
  std::int64_t target_pictures = 0;
  std::int64_t grid_pictures = 0;
  std::int64_t grid_points = 0;
  int spot_groups = 0;
  double exposure_seconds = 0;  ///< all exposures, one after the other
  std::uint64_t disk_bytes = 0;
};

CapturePlan PlanCapture(const RigDescription& rig, const CameraInfo& camera);

}  // namespace nacre::acquire

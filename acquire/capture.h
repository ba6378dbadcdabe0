#pragma once

#include "acquire/camera.h"
#include "acquire/illuminator.h"
#include "acquire/sample_stage.h"
#include "acquire/session_writer.h"
#include "core/progress.h"

#include <cstdint>

namespace nacre::acquire {

/// The parts of a rig.
struct Devices {
  Camera& camera;
  Illuminator& illuminator;
  SampleStage& stage;
};

struct CaptureSummary {
  std::int64_t pictures_taken = 0;  ///< by this call
  std::int64_t frames_lost = 0;     ///< and asked for again
  double seconds = 0;
};

/// Takes the pictures before the sample's that are still missing: dark frames,
/// checkerboard, flat pairs, laser lattice.
///
/// Both calls: write and expose at the same time; ask three times again for a lost
/// frame before they give up with a DeviceError; leave the laser dark however they end.
/// If `progress` answers false they finish the picture in flight and throw Interrupted;
/// the session can be resumed then, as after any error or kill, and ends up with the
/// same bits.
CaptureSummary CaptureCalibration(SessionWriter& session,
                                  const Devices& devices,
                                  const ProgressFunction& progress = {});

/// Takes the pictures of the sample that are still missing, the laser aimed by `map`,
/// which is noted in the manifest. Requires that the calibration pictures are there.
CaptureSummary CaptureGrid(SessionWriter& session,
                           const Devices& devices,
                           const ScanMap& map,
                           const ProgressFunction& progress = {});

/// What a capture will take, for `--plan`.
struct CapturePlan {
  std::int64_t target_pictures = 0;
  std::int64_t grid_pictures = 0;
  int spot_groups = 0;
  double exposure_seconds = 0;  ///< all exposures, one after the other
  std::uint64_t disk_bytes = 0;
};

CapturePlan PlanCapture(const RigDescription& rig, const CameraInfo& camera);

}  // namespace nacre::acquire

#pragma once

#include "acquire/capture.h"
#include "acquire/session_writer.h"

#include <cstdint>

namespace nacre::acquire::internal {

/// Brings the rig into the state that a picture asks for, changing only what differs,
/// and takes it. The laser is dark while the camera is away, and after this is gone.
class RigState {
 public:
  /// All must outlive this; `map` aims at the sample and may be null before it.
  RigState(const SessionWriter& session, const Devices& devices, const ScanMap* map);
  ~RigState();
  RigState(const RigState&) = delete;
  RigState& operator=(const RigState&) = delete;

  /// The picture of that number. Counts lost frames and failures of the light into
  /// `summary`. DeviceError if it can't be had.
  PackedFrame Take(std::int64_t number, CaptureSummary& summary);

 private:
  double Set(std::int64_t number);
  void SetLight(std::int64_t number);

  const SessionWriter& session_;
  const Devices& devices_;
  const ScanMap* map_;
  ScheduledPicture last_;
  bool known_ = false;        // whether last_ is what the rig is in
  bool light_known_ = false;  // and the light too: not blanked since
  double applied_exposure_us_ = 0;
};

}  // namespace nacre::acquire::internal

#pragma once

#include "acquire/aravis_camera.h"
#include "acquire/internal/aravis_handles.h"
#include "acquire/mono_format.h"

#include <atomic>
#include <chrono>
#include <optional>

namespace nacre::acquire::internal {

/// A camera from its opening until it goes away or is closed: under control, set, and
/// waiting for triggers.
class AravisConnection {
 public:
  /// Throws DeviceError. Counts into `statistics`, which must outlive Capture.
  AravisConnection(const AravisOptions& options, CameraStatistics& statistics);
  /// Takes some seconds if the camera is gone.
  ~AravisConnection();
  AravisConnection(const AravisConnection&) = delete;
  AravisConnection& operator=(const AravisConnection&) = delete;

  const CameraInfo& info() const { return info_; }
  double SetExposureUs(double exposure_us);
  /// Empty for any frame that can't be trusted. DeviceError if the camera doesn't obey.
  std::optional<Frame> Capture(std::chrono::milliseconds timeout);
  /// Asks the camera whether it still obeys this program.
  bool IsConnected();
  /// Of this connection's stream.
  std::uint64_t StreamCount(const char* name) const;

 private:
  void TakeControl();
  void OpenStream();
  void DropLateFrames();
  void Restart();
  ArvBuffer* WaitForBuffer(std::chrono::milliseconds timeout);
  std::optional<Frame> Read(ArvBuffer* buffer);
  bool IsDue(std::uint64_t frame_id) const;

  const AravisOptions options_;
  const MonoFormat& format_;
  CameraStatistics& statistics_;
  std::atomic<bool> control_lost_ = false;
  GHandle<ArvCamera> camera_;
  GHandle<ArvStream> stream_;  // after camera_, so that it is closed before
  CameraInfo info_;
  std::optional<std::uint64_t> last_frame_id_;
};

}  // namespace nacre::acquire::internal

#pragma once

#include "acquire/aravis_camera.h"
#include "acquire/internal/aravis_handles.h"
#include "acquire/pixel_format.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>

namespace nacre::acquire::internal {

/// Takes buffers back into a stream for as long as there is one: frames may outlive it.
class BufferReturn {
 public:
  explicit BufferReturn(ArvStream* stream) : stream_(stream) {}
  void Close() {
    const std::lock_guard lock(mutex_);
    stream_ = nullptr;
  }
  void Take(ArvBuffer* buffer) {
    const std::lock_guard lock(mutex_);
    if (stream_ != nullptr) {
      arv_stream_push_buffer(stream_, buffer);
    } else {
      g_object_unref(buffer);
    }
  }

 private:
  std::mutex mutex_;
  ArvStream* stream_;
};

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
  std::optional<PackedFrame> Capture(std::uint64_t picture_number,
                                     std::chrono::milliseconds timeout);
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
  std::optional<PackedFrame> Read(const std::shared_ptr<ArvBuffer>& buffer);
  std::shared_ptr<ArvBuffer> Lend(ArvBuffer* buffer);
  void TellNumber(std::uint64_t picture_number);
  void ReadTemperature();
  bool IsDue(std::uint64_t frame_id) const;

  const AravisOptions options_;
  const PixelFormat& format_;
  CameraStatistics& statistics_;
  std::atomic<bool> control_lost_ = false;
  GHandle<ArvCamera> camera_;
  GHandle<ArvStream> stream_;  // after camera_, so that it is closed before
  CameraInfo info_;
  std::shared_ptr<BufferReturn> lender_;  // of the stream's buffers
  std::size_t payload_bytes_ = 0;
  std::optional<std::uint64_t> last_frame_id_;
  bool takes_number_ = false;
  std::optional<std::uint64_t> told_number_;
  std::optional<double> gain_;
  bool has_temperature_ = false;
  std::optional<double> temperature_c_;
  std::chrono::steady_clock::time_point temperature_at_;
  std::uint64_t resent_packets_ = 0;  // when the last good frame was there
};

}  // namespace nacre::acquire::internal

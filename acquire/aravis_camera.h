#pragma once

#include "acquire/aravis_options.h"
#include "acquire/camera.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace nacre::acquire {

/// A camera that answered on a network or a USB bus.
struct FoundCamera {
  std::string id;        ///< opens it
  std::string address;   ///< IP address, or place on the USB
  std::string protocol;  ///< "GigEVision" or "USB3Vision"
  std::string vendor;
  std::string model;
  std::string serial;
};

/// All cameras that answer; takes about a second.
std::vector<FoundCamera> FindCameras();

/// What became of the triggers so far, over all connections.
struct CameraStatistics {
  std::int64_t frames = 0;            ///< whole and handed on
  std::int64_t incomplete = 0;        ///< lacked packets
  std::int64_t timed_out = 0;         ///< no frame came
  std::int64_t late = 0;              ///< came when nobody waited any more; dropped
  std::int64_t skipped_ids = 0;       ///< not the frame number that was due; dropped
  std::int64_t reconnections = 0;     ///< after the camera had gone
  std::uint64_t missing_packets = 0;  ///< of GigE Vision
  std::uint64_t resent_packets = 0;   ///< and got after all
};

/// A GigE Vision or USB3 Vision camera by the Aravis library, with exclusive control.
///
/// A frame that is incomplete, late or out of sequence is counted and not handed on:
/// Capture is empty then and the caller asks again. If the camera goes away, Capture
/// and SetExposureUs wait for it, set it as it was and read that back; Capture is empty
/// then too. DeviceError if it isn't back in time, or is another or set otherwise.
class AravisCamera final : public Camera {
 public:
  /// Throws DeviceError if there is no such camera, another program controls it, or it
  /// doesn't take a setting, saying which values it takes.
  explicit AravisCamera(const AravisOptions& options);
  ~AravisCamera() override;
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  CameraInfo Info() const override;
  double SetExposureUs(double exposure_us) override;
  /// With a hardware trigger: the next pulse's frame.
  std::optional<Frame> Capture(std::uint64_t picture_number,
                               std::chrono::milliseconds timeout) override;
  std::optional<PackedFrame> CapturePacked(std::uint64_t picture_number,
                                           std::chrono::milliseconds timeout) override;
  void OnAway(const std::function<void(bool away)>& listener) override;

  CameraStatistics Statistics() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace nacre::acquire

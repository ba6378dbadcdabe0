#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace nacre::acquire {

/// What a camera is and can do.
struct CameraInfo {
  std::string model;
  std::string serial;
  int width = 0;  ///< pixels
  int height = 0;
  int bit_depth = 0;  ///< of a count; saturation is at 2^bit_depth − 1
  double min_exposure_us = 0;
  double max_exposure_us = 0;
};

/// One picture as the sensor gave it.
struct Frame {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> counts;  ///< width · height, row by row from the top
  double exposure_us = 0;             ///< as applied
  std::uint64_t frame_id = 0;         ///< the device's own
  std::int64_t timestamp_ns = 0;      ///< the device's clock
};

/// A monochrome camera under software trigger. Destroying it leaves it idle.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual CameraInfo Info() const = 0;

  /// Returns the exposure that was applied: devices round. Throws DeviceError out of
  /// range.
  virtual double SetExposureUs(double exposure_us) = 0;

  /// Exposes and reads one picture. `picture_number` names it within the session: a
  /// repeated number asks for the same picture again (a simulated camera repeats its
  /// noise too, which makes an interrupted session equal to one that ran through).
  /// Empty if the frame was lost or incomplete: ask again. Throws DeviceError if the
  /// camera is gone.
  virtual std::optional<Frame> Capture(std::uint64_t picture_number,
                                       std::chrono::milliseconds timeout) = 0;

  /// The listener is called from inside SetExposureUs and Capture: with true as soon as
  /// the camera is found to be away, before it is waited for, with false once it is
  /// back. None to begin with; an empty one ends it.
  virtual void OnAway(std::function<void(bool away)> /*listener*/) {}
};

}  // namespace nacre::acquire

#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
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
  /// Colours of the pixels as in acquire/pixel_format.h: "" monochrome, "RGGB", …: a
  /// mosaic, "RGB": three counts a pixel.
  std::string mosaic = {};

  int SamplesPerPixel() const { return mosaic == "RGB" ? 3 : 1; }
};

/// One picture as the sensor gave it.
struct Frame {
  int width = 0;
  int height = 0;
  /// width · height · samples a pixel, row by row from the top; a mosaic as it is.
  std::vector<std::uint16_t> counts;
  double exposure_us = 0;                     ///< as applied
  std::uint64_t frame_id = 0;                 ///< the device's own
  std::int64_t timestamp_ns = 0;              ///< the device's clock
  std::optional<double> gain = std::nullopt;  ///< in the camera's unit, if it tells
  std::optional<double> temperature_c = std::nullopt;  ///< of the camera, if it tells
  int attempts = 1;                  ///< this one and those before it that were lost
  std::uint64_t resent_packets = 0;  ///< that this frame and lost ones before it took
};

/// A frame that came in whole, its counts still packed as the camera sent them, so that
/// the camera goes on while another thread unpacks.
struct PackedFrame {
  Frame frame;  ///< all but the counts, if `unpack` isn't empty
  std::function<void(Frame&)> unpack = {};  ///< fills in the counts; once, any thread

  Frame Unpacked() && {
    if (unpack) {
      unpack(frame);
    }
    return std::move(frame);
  }
};

/// A camera that takes a picture when told to. Destroying it leaves it idle.
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

  /// The same without waiting for the counts. A camera keeps the memory of frames that
  /// weren't unpacked or dropped yet.
  virtual std::optional<PackedFrame> CapturePacked(std::uint64_t picture_number,
                                                   std::chrono::milliseconds timeout) {
    std::optional<Frame> frame = Capture(picture_number, timeout);
    if (!frame) {
      return std::nullopt;
    }
    return PackedFrame{.frame = std::move(*frame)};
  }

  /// The listener is called from inside SetExposureUs and Capture: with true as soon as
  /// the camera is found to be away, before it is waited for, with false once it is
  /// back. None to begin with; an empty one ends it.
  virtual void OnAway(const std::function<void(bool away)>& /*listener*/) {}
};

}  // namespace nacre::acquire

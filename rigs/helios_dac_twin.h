#pragma once

#include "acquire/laser_frame.h"

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace nacre::rigs {

struct HeliosDacTwinOptions {
  std::string name = "Helios 12345";
  std::uint32_t firmware = 6;
  int port = 1;  ///< of the emulated USB; one for each DAC
};

/// A stretch of time, of CLOCK_MONOTONIC, in which light came out.
struct LitSpan {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

/// What reached the device over the USB.
struct DacCounts {
  std::int64_t frames = 0;
  std::int64_t discarded = 0;  ///< soon after a stop
  std::int64_t looping = 0;    ///< frames that weren't to be put out once only
  std::int64_t malformed = 0;  ///< transfers that no firmware takes
  std::int64_t stops = 0;
};

/// A Helios laser DAC that exists only on an emulated USB (umockdev): enumeration,
/// hotplug, control, bulk and interrupt transfers, so that a true driver can be run
/// against it by the true libusb, from this process and from children of it. The
/// program must have been started by umockdev-wrapper.
///
/// Firmware as of 2023: puts out one frame while a second waits; is deaf for 100 ms
/// after a stop; loses frames of some sizes. As with the kernel's USB, an interface is
/// for one program alone, and is taken from a program that dies.
class HeliosDacTwin {
 public:
  /// Plugged in.
  explicit HeliosDacTwin(const HeliosDacTwinOptions& options = {});
  ~HeliosDacTwin();
  HeliosDacTwin(const HeliosDacTwin&) = delete;
  HeliosDacTwin& operator=(const HeliosDacTwin&) = delete;

  void Plug();
  void Unplug();

  /// Pulls the plug when the frame after `frames` more arrives; back after `away`.
  void UnplugAfter(int frames, std::chrono::milliseconds away);
  /// The frame after `frames` more is answered by STALL.
  void StallAfter(int frames);
  /// The answer after `answers` more never comes.
  void HangAfter(int answers);

  /// The frame that is put out now; null if the shutter is closed or there is none.
  std::shared_ptr<const acquire::LaserFrame> Emitting() const;
  bool IsShutterOpen() const;
  std::string name() const;
  DacCounts counts() const;
  /// All light so far, to the accuracy of a frame; the last span may be open and ends
  /// now then.
  std::vector<LitSpan> LitSpans() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Whether this program may have emulated devices: it was started by umockdev-wrapper.
bool CanEmulateUsb();

/// CLOCK_MONOTONIC.
std::int64_t MonotonicNs();

}  // namespace nacre::rigs

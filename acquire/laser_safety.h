#pragma once

#include "acquire/laser_frame.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace nacre::acquire {

/// What no frame may exceed, whoever asks for it.
struct LaserLimits {
  std::array<int, 2> x_steps{0, 0};  ///< lit points lie within, ends included
  std::array<int, 2> y_steps{0, 0};
  std::array<std::uint8_t, 3> max_level{};  ///< of red, green, blue; 255 is full power
  double max_dwell_us = 0;                  ///< lit in one place without a pause
  double max_duty = 0;   ///< share of a frame's time lit in one place
  double max_lit_s = 0;  ///< from the first lit frame to the next dark one
};

enum class LaserState {
  kDisarmed,  ///< dark, shutter closed; the state at the start
  kArmed,     ///< dark, shutter open
  kLit,       ///< shutter open
  kStopped,   ///< emergency stop: dark, shutter closed, until it is cleared on purpose
};

const char* Name(LaserState state);

/// A frame that was found to be within the limits, and may be put out as long as the
/// laser has been neither disarmed nor dark since. Only LaserSafety makes them, and
/// LaserDac takes nothing else.
class CheckedFrame {
 public:
  const LaserFrame& frame() const { return frame_; }
  bool MayBePutOut() const { return dark_ || *epoch_ == checked_in_; }

 private:
  friend class LaserSafety;
  CheckedFrame(LaserFrame frame,
               bool dark,
               std::shared_ptr<const std::atomic<std::uint64_t>> epoch)
      : frame_(std::move(frame)),
        dark_(dark),
        epoch_(std::move(epoch)),
        checked_in_(*epoch_) {}

  LaserFrame frame_;
  bool dark_;
  std::shared_ptr<const std::atomic<std::uint64_t>> epoch_;
  std::uint64_t checked_in_;
};

/// The safety of a scanned laser as a state machine. Does no input or output: its owner
/// tells it what happens, asks it what the shutter shall be, and puts out only frames
/// that it has checked.
///
///   kDisarmed --Arm--> kArmed --lit frame--> kLit --dark frame--> kArmed
///   kArmed, kLit --Disarm, refused frame--> kDisarmed
///   all --EmergencyStop--> kStopped --ClearEmergencyStop--> kDisarmed
///
/// Whatever goes wrong (a device is lost, an error, a signal) is a Disarm. It is no
/// interlock: those are hardware.
class LaserSafety {
 public:
  /// A frame lasts at least this long, or a host is too slow to feed the next.
  static constexpr double kShortestFrameS = 0.010;
  /// And at most this long: one that is put out and one that waits end by themselves
  /// within 50 ms, should the host die.
  static constexpr double kLongestFrameS = 0.025;

  /// A frame has at most so many points: what a Helios takes.
  static constexpr int kMostPoints = 4095;

  explicit LaserSafety(const LaserLimits& limits);

  LaserState state() const { return state_; }
  bool ShutterMayBeOpen() const {
    return state_ == LaserState::kArmed || state_ == LaserState::kLit;
  }

  /// Throws DeviceError while stopped.
  void Arm();
  void Disarm() noexcept;
  void EmergencyStop(const std::string& reason);
  void ClearEmergencyStop() noexcept;

  /// Passes a frame without light in every state, one with light if armed and within
  /// all limits. `now_s` is of any steady clock. Throws DeviceError saying which limit,
  /// and disarms: a caller that asks for the forbidden isn't to be trusted.
  CheckedFrame Check(LaserFrame frame, double now_s);

 private:
  std::optional<std::string> Refusal(const LaserFrame& frame, double now_s) const;
  std::optional<std::string> ShapeRefusal(const LaserFrame& frame) const;
  std::optional<std::string> PointRefusal(const LaserPoint& point) const;
  std::optional<std::string> DwellRefusal(const LaserFrame& frame) const;
  void Leave(LaserState state) noexcept;

  LaserLimits limits_;
  LaserState state_ = LaserState::kDisarmed;
  std::string stop_reason_;
  double lit_since_s_ = 0;
  std::shared_ptr<std::atomic<std::uint64_t>> epoch_;
};

}  // namespace nacre::acquire

#pragma once

#include "acquire/laser_dac.h"
#include "acquire/laser_safety.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace nacre::acquire {

/// Keeps a laser lit by sending the same play-once frame again and again, each one
/// checked by LaserSafety; notices if one came late; opens a DAC that was lost again
/// and arms it as it was. For one thread at a time; never waits longer than a transfer.
///
/// Times are of any steady clock, in seconds, and never decrease.
class LaserFeeder {
 public:
  struct Settings {
    LaserLimits limits;
    LaserFrame dark;  ///< put out to end the light
    double reconnect_s = 60;
    std::function<std::unique_ptr<LaserDac>()> open;  ///< throws DeviceError
    std::function<double()> clock_s;
  };

  /// Opens the DAC.
  explicit LaserFeeder(Settings settings);
  /// Dark, shutter closed.
  ~LaserFeeder();
  LaserFeeder(const LaserFeeder&) = delete;
  LaserFeeder& operator=(const LaserFeeder&) = delete;

  /// Opens the shutter; throws DeviceError in an emergency stop.
  void Arm();
  /// Dark at once, shutter closed.
  void Disarm() noexcept;
  /// The same, and stays so until it is cleared; then the laser is disarmed.
  void EmergencyStop(const std::string& reason) noexcept;
  void ClearEmergencyStop() noexcept;
  LaserState state() const { return safety_.state(); }

  /// What is to be put out from now on. Throws DeviceError if the laser isn't armed.
  void Show(const LaserFrame& frame);
  void ShowNothing() noexcept;

  /// To be called again and again. Never throws for a device: loses it and seeks it.
  void Step() noexcept;

  /// What was asked for last is put out, and the next frame waits in the DAC.
  bool IsSteady() const;
  /// How often lit frames that were due may have come late or not at all, until now.
  std::int64_t CountInterruptions();
  /// Why the light isn't to be had, if so: the DAC stayed away, or a frame was refused,
  /// which disarms. Cleared by Arm and by Show.
  const std::optional<std::string>& failure() const { return failure_; }
  bool HasDac() const { return dac_ != nullptr; }
  /// No light is out after this time if no frame is sent any more.
  double dark_by_s() const { return dark_by_s_; }

 private:
  void Lose(const std::string& reason) noexcept;
  void CloseShutter() noexcept;
  void Reopen();
  void Feed();
  bool IsLate() const;
  void FeedDark();
  void FeedLit();
  bool Send(LaserFrame frame);

  Settings settings_;
  LaserSafety safety_;
  std::unique_ptr<LaserDac> dac_;
  bool armed_ = false;  // by its owner; a DAC that comes back is armed again
  std::optional<LaserFrame> shown_;
  int sent_ = 0;           // frames of what is shown
  bool dark_sent_ = true;  // the light was ended, and nothing lit sent since
  double begins_s_ = 0;    // the last one sent, at the earliest
  double dark_by_s_ = 0;
  double polled_s_ = 0;
  double retry_s_ = 0;
  double pause_s_ = 0;
  double give_up_s_ = 0;
  std::string lost_reason_;
  std::int64_t interruptions_ = 0;
  std::optional<std::string> failure_;
};

}  // namespace nacre::acquire

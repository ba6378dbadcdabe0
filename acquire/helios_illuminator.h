#pragma once

#include "acquire/helios_options.h"
#include "acquire/illuminator.h"
#include "acquire/laser_safety.h"
#include "acquire/spot_frames.h"

#include <memory>
#include <string>
#include <vector>

namespace nacre::acquire {

/// The limits in steps of the DAC, rounded towards less.
LaserLimits MakeLimits(const HeliosOptions& options, const SafetyDescription& safety);

/// A laser projector behind a Helios DAC. A thread of its own keeps the light on by
/// frames of at most 25 ms that are put out once each; so the light ends by itself if
/// that thread or this process does.
///
/// Disarmed at the start; Arm() is for a person to decide on. All calls of Illuminator
/// may come from one thread at a time, EmergencyStop from any.
class HeliosIlluminator final : public Illuminator {
 public:
  /// Throws DeviceError if the DAC can't be had.
  HeliosIlluminator(const HeliosOptions& options,
                    const SafetyDescription& safety,
                    const SpotTiming& timing,
                    std::vector<std::string> channels);
  /// Disarms.
  ~HeliosIlluminator() override;
  HeliosIlluminator(const HeliosIlluminator&) = delete;
  HeliosIlluminator& operator=(const HeliosIlluminator&) = delete;

  void Arm();
  void Disarm() noexcept;
  void EmergencyStop(const std::string& reason) noexcept;
  void ClearEmergencyStop() noexcept;
  LaserState state() const;

  IlluminatorInfo Info() const override;
  void Light(std::span<const ScanAngle> spots, int channel) override;
  void Blank() noexcept override;
  void AwaitSteady() override;
  std::int64_t Interruptions() const override;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace nacre::acquire

#pragma once

#include "acquire/laser_dac.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace nacre::acquire {

/// A Helios laser DAC that is plugged in.
struct FoundDac {
  std::string name;  ///< that it was given; opens it
  int bus = 0;       ///< place on the USB
  int address = 0;
  std::uint32_t firmware = 0;
  std::string trouble;  ///< why the name can't be read; empty if it can
};

/// All Helios DACs. Opens each for a moment, unless a program has it.
std::vector<FoundDac> FindHeliosDacs();

/// Gives the DAC at that place of the USB another name, which it keeps.
void NameHeliosDac(int bus, int address, const std::string& name);

/// A Helios laser DAC by libusb, for this program alone, with a watch-dog process that
/// stops it and closes its shutter should this program die. Opened with the shutter
/// closed; destroying it stops it and closes the shutter.
class HeliosDac final : public LaserDac {
 public:
  /// Throws DeviceError if there is no DAC of that name, or are several, or another
  /// program has it. An empty name stands for the only one that there is.
  explicit HeliosDac(const std::string& name);
  ~HeliosDac() override;
  HeliosDac(const HeliosDac&) = delete;
  HeliosDac& operator=(const HeliosDac&) = delete;

  const std::string& name() const;
  std::uint32_t firmware() const;

  /// Throws DeviceError if the watch-dog is gone too.
  bool IsReady() override;
  void Stop() override;
  void SetShutter(bool open) override;

 private:
  void Write(const LaserFrame& frame) override;
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace nacre::acquire

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace nacre::acquire {

struct IlluminatorInfo {
  std::string model;
  std::string serial;
  std::vector<std::string>
      channels;  ///< "R", "G", "B" or "638nm", …; may be lit one at a time
  double max_angle_rad = 0;  ///< scan angles reach ± this on both axes
};

/// The direction of a beam, as optical scan angles of the two mirrors.
struct ScanAngle {
  double x_rad = 0;
  double y_rad = 0;
  friend bool operator==(const ScanAngle&, const ScanAngle&) = default;
};

/// A scanned light source. Disarmed at start; destroying it leaves it dark.
class Illuminator {
 public:
  virtual ~Illuminator() = default;
  virtual IlluminatorInfo Info() const = 0;

  /// Lights these spots with one channel until Blank() or the next call; returns when
  /// they are lit. The mean power of a spot is the same however many there are; their
  /// order, which is that of their visits, changes no picture. Throws DeviceError
  /// outside ± max_angle_rad or if the device is gone and doesn't come back.
  virtual void Light(std::span<const ScanAngle> spots, int channel) = 0;

  /// No light at all. Never throws: this is what error paths call.
  virtual void Blank() noexcept = 0;

  /// Returns when the light is as Light() or Blank() asked for last. Throws DeviceError
  /// if the device doesn't come back.
  virtual void AwaitSteady() {}

  /// How often the light wasn't as asked for, so far. To be asked for before
  /// AwaitSteady() and after the exposure: a picture between which it grew must be
  /// taken again.
  virtual std::int64_t Interruptions() const { return 0; }
};

}  // namespace nacre::acquire

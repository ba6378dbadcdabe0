#pragma once

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

  /// Lights these spots with one channel, at full power a spot, until Blank() or the
  /// next call. Throws DeviceError outside ± max_angle_rad or if the device is gone.
  virtual void Light(std::span<const ScanAngle> spots, int channel) = 0;

  /// No light at all. Never throws: this is what error paths call.
  virtual void Blank() noexcept = 0;
};

}  // namespace nacre::acquire

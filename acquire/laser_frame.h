#pragma once

#include <cstdint>
#include <vector>

namespace nacre::acquire {

/// What a laser DAC puts out for one period of its clock.
struct LaserPoint {
  std::uint16_t x = 0;  ///< steps of a ScanField
  std::uint16_t y = 0;
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  std::uint8_t intensity = 0;

  /// Whether a projector of any wiring may emit light.
  bool IsLit() const { return (r | g | b | intensity) != 0; }
  friend bool operator==(const LaserPoint&, const LaserPoint&) = default;
};

/// Points that are put out one after the other, once.
struct LaserFrame {
  int points_per_s = 0;
  std::vector<LaserPoint> points;
  bool at_once = false;  ///< instead of the frame that is being put out, not after it

  double Seconds() const {
    return static_cast<double>(points.size()) / static_cast<double>(points_per_s);
  }
};

}  // namespace nacre::acquire

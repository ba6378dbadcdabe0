#pragma once

#include "acquire/illuminator.h"
#include "acquire/projector_options.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::acquire {

/// Pictures of spots for a projector of width × height pixels. An angle is a pixel's
/// distance from the picture's middle, in proportion: ±max_angle_rad are its left and
/// right end, +y is up. Where a pixel's light arrives is found by calibration.
///
/// Spots are discs of the same pixels each, so that all have the same power; so their
/// middles are whole pixels, the nearest ones.
class ProjectorPattern {
 public:
  /// Throws DeviceError if the field is larger than the picture.
  ProjectorPattern(int width, int height, const ProjectorOptions& options);

  int width() const { return width_; }
  int height() const { return height_; }

  /// 0xRRGGBB, row by row from the top. Throws DeviceError if a disc isn't wholly
  /// inside of the field.
  std::vector<std::uint32_t> Draw(std::span<const ScanAngle> spots, int channel) const;
  std::vector<std::uint32_t> Black() const;

 private:
  double X(double angle_rad) const;
  double Y(double angle_rad) const;

  int width_;
  int height_;
  ProjectorOptions options_;
};

}  // namespace nacre::acquire

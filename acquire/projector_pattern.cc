#include "acquire/projector_pattern.h"

#include "core/error.h"

#include <cmath>
#include <fmt/format.h>

namespace nacre::acquire {

ProjectorPattern::ProjectorPattern(int width,
                                   int height,
                                   const ProjectorOptions& options)
    : width_(width), height_(height), options_(options) {
  // Half a pixel beyond the outermost pixels' middles is still theirs.
  if (X(options.field_x_rad[0]) < -0.5 || X(options.field_x_rad[1]) > width - 0.5 ||
      Y(options.field_y_rad[1]) < -0.5 || Y(options.field_y_rad[0]) > height - 0.5) {
    throw DeviceError(fmt::format(
        "the projector's field of {:.4f} to {:.4f} by {:.4f} to {:.4f} rad isn't "
        "within its picture of {} x {} pixels, which reaches {:.4f} by {:.4f} rad from "
        "its middle; make field_x_deg and field_y_deg smaller",
        options.field_x_rad[0],
        options.field_x_rad[1],
        options.field_y_rad[0],
        options.field_y_rad[1],
        width,
        height,
        options.max_angle_rad,
        options.max_angle_rad * height / width));
  }
}

double ProjectorPattern::X(double angle_rad) const {
  return 0.5 * (width_ - 1) + angle_rad / options_.max_angle_rad * 0.5 * width_;
}

double ProjectorPattern::Y(double angle_rad) const {
  return 0.5 * (height_ - 1) - angle_rad / options_.max_angle_rad * 0.5 * width_;
}

std::vector<std::uint32_t> ProjectorPattern::Black() const {
  return std::vector<std::uint32_t>(static_cast<std::size_t>(width_) *
                                    static_cast<std::size_t>(height_));
}

std::vector<std::uint32_t> ProjectorPattern::Draw(std::span<const ScanAngle> spots,
                                                  int channel) const {
  Expect(channel >= 0 && channel < std::ssize(options_.power), "one of the channels");
  const auto level = static_cast<std::uint32_t>(
      std::floor(options_.power[static_cast<std::size_t>(channel)] * 255));
  const std::uint32_t colour = level << (8 * (2 - channel));
  const int radius = (options_.spot_px - 1) / 2;
  std::vector<std::uint32_t> picture = Black();
  for (const ScanAngle& spot : spots) {
    const double x = std::round(X(spot.x_rad));
    const double y = std::round(Y(spot.y_rad));
    // So written that an angle that is no number is refused too.
    if (!(x - radius >= X(options_.field_x_rad[0]) &&
          x + radius <= X(options_.field_x_rad[1]) &&
          y - radius >= Y(options_.field_y_rad[1]) &&
          y + radius <= Y(options_.field_y_rad[0]))) {
      throw DeviceError(fmt::format(
          "the projector was asked for a spot at ({:.4f}, {:.4f}) rad, which isn't "
          "wholly inside of its field of {:.4f} to {:.4f} by {:.4f} to {:.4f} rad. Is "
          "the grid larger than field_x_deg and field_y_deg?",
          spot.x_rad,
          spot.y_rad,
          options_.field_x_rad[0],
          options_.field_x_rad[1],
          options_.field_y_rad[0],
          options_.field_y_rad[1]));
    }
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dx = -radius; dx <= radius; ++dx) {
        if (4 * (dx * dx + dy * dy) <= options_.spot_px * options_.spot_px) {
          const auto row =
              static_cast<std::size_t>(std::int64_t{static_cast<int>(y)} + dy);
          const auto column =
              static_cast<std::size_t>(std::int64_t{static_cast<int>(x)} + dx);
          picture[row * static_cast<std::size_t>(width_) + column] = colour;
        }
      }
    }
  }
  return picture;
}

}  // namespace nacre::acquire

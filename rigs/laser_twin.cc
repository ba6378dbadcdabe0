#include "rigs/laser_twin.h"

#include "core/error.h"

#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace nacre::rigs {

Spot LaserModel::SpotAt(acquire::ScanAngle angle) const {
  const double tan_x = std::tan(angle.x_rad);
  const double cos_y = std::cos(angle.y_rad);
  const double x = (separation_mm + distance_mm / cos_y) * tan_x;
  const double y = distance_mm * std::tan(angle.y_rad);
  const double c = std::cos(rotation_rad);
  const double s = std::sin(rotation_rad);
  return {{offset_mm.x + c * x - s * y, offset_mm.y + s * x + c * y},
          std::cos(angle.x_rad) * cos_y};
}

LaserTwin::LaserTwin(LaserModel model, std::shared_ptr<World> world)
    : model_(std::move(model)), world_(std::move(world)) {
  Expect(model_.power_mw.size() == model_.channels.size(), "a power for each channel");
  Blank();
}

LaserTwin::~LaserTwin() {
  Blank();
}

acquire::IlluminatorInfo LaserTwin::Info() const {
  return {.model = "nacre laser twin",
          .serial = "1",
          .channels = model_.channels,
          .max_angle_rad = model_.max_angle_rad};
}

void LaserTwin::Light(std::span<const acquire::ScanAngle> spots, int channel) {
  if (channel < 0 || channel >= static_cast<int>(model_.channels.size())) {
    throw DeviceError(fmt::format("the laser was asked for channel {}; it has {}",
                                  channel,
                                  model_.channels.size()));
  }
  std::vector<Spot> lit;
  for (const acquire::ScanAngle& angle : spots) {
    if (!(std::abs(angle.x_rad) <= model_.max_angle_rad &&
          std::abs(angle.y_rad) <= model_.max_angle_rad)) {
      throw DeviceError(
          fmt::format("the laser was asked for scan angles ({:.4f}, {:.4f}) rad; it "
                      "reaches ±{:.4f} rad. Is the grid larger than the scan field?",
                      angle.x_rad,
                      angle.y_rad,
                      model_.max_angle_rad));
    }
    lit.push_back(model_.SpotAt(angle));
  }
  world_->spots = std::move(lit);
  world_->channel = channel;
  ++world_->revision;
}

void LaserTwin::Blank() noexcept {
  world_->spots.clear();
  ++world_->revision;
}

}  // namespace nacre::rigs

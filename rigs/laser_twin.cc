#include "rigs/laser_twin.h"

#include "acquire/scan_field.h"
#include "core/error.h"

#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace nacre::rigs {

namespace {

// The mirrors' angles when sent to these one after the other, over and over.
std::vector<acquire::ScanAngle> WithHysteresis(std::span<const acquire::ScanAngle> sent,
                                               double hysteresis_rad) {
  std::vector<acquire::ScanAngle> reached(sent.begin(), sent.end());
  const auto lag = [&](auto axis) {
    // A mirror that isn't moved stays on the side it came from.
    double side = 0;
    for (int round = 0; round < 2; ++round) {
      for (std::size_t k = 0; k < sent.size(); ++k) {
        const double before = sent[(k + sent.size() - 1) % sent.size()].*axis;
        const double move = sent[k].*axis - before;
        side = move > 0 ? 1 : move < 0 ? -1 : side;
        reached[k].*axis = sent[k].*axis - side * hysteresis_rad;
      }
    }
  };
  if (hysteresis_rad != 0) {
    lag(&acquire::ScanAngle::x_rad);
    lag(&acquire::ScanAngle::y_rad);
  }
  return reached;
}

}  // namespace

PointMm LaserModel::PointAt(acquire::ScanAngle angle, double height_mm) const {
  const double tan_x = std::tan(angle.x_rad);
  const double cos_y = std::cos(angle.y_rad);
  const double drop_mm = distance_mm - height_mm;
  const double x = (separation_mm + drop_mm / cos_y) * tan_x;
  const double y = drop_mm * std::tan(angle.y_rad);
  const double c = std::cos(rotation_rad);
  const double s = std::sin(rotation_rad);
  return {offset_mm.x + c * x - s * y, offset_mm.y + s * x + c * y};
}

Spot LaserModel::SpotAt(acquire::ScanAngle angle) const {
  Spot spot{.centre_mm = PointAt(angle, 0),
            .cos_incidence = std::cos(angle.x_rad) * std::cos(angle.y_rad)};
  spot.on_sample_mm = spot.centre_mm;
  if (!sample.IsIdeal()) {
    // The beam is steep and the surface isn't: each round gains their slopes' product.
    PointMm hit = spot.centre_mm;
    for (int round = 0; round < 6; ++round) {
      hit = PointAt(angle, sample.HeightAt(hit));
    }
    spot.on_sample_mm = sample.SurfaceFromSample(hit);
    const PointMm above = PointAt(angle, 1);
    const double dx = above.x - spot.centre_mm.x;
    const double dy = above.y - spot.centre_mm.y;
    const double length = std::sqrt(dx * dx + dy * dy + 1);
    const double normal = std::sqrt(1 + sample.slope_x * sample.slope_x +
                                    sample.slope_y * sample.slope_y);
    spot.cos_incidence =
        (1 - sample.slope_x * dx - sample.slope_y * dy) / (length * normal);
  }
  return spot;
}

double LaserModel::RoundSigmaMm() const {
  return spot_sigma_mm / std::sqrt(spot_aspect);
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
  int beam = 0;
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
  }
  // Two round spots, so far from the middle, have the second moments of one long one.
  const double apart_mm =
      model_.RoundSigmaMm() * std::sqrt(model_.spot_aspect * model_.spot_aspect - 1);
  const PointMm apart = {apart_mm * std::cos(model_.spot_angle_rad),
                         apart_mm * std::sin(model_.spot_angle_rad)};
  std::vector<acquire::ScanAngle> sent(spots.begin(), spots.end());
  if (model_.has_dac) {
    for (acquire::ScanAngle& angle : sent) {
      angle = acquire::ScanField{model_.max_angle_rad}.Snap(angle);
    }
  }
  for (const acquire::ScanAngle& angle : WithHysteresis(sent, model_.hysteresis_rad)) {
    Spot spot = model_.SpotAt(angle);
    spot.beam = beam++;
    if (apart_mm > 0) {
      spot.power = 0.5;
      Spot other = spot;
      for (PointMm* point : {&spot.centre_mm, &spot.on_sample_mm}) {
        *point = {point->x + apart.x, point->y + apart.y};
      }
      for (PointMm* point : {&other.centre_mm, &other.on_sample_mm}) {
        *point = {point->x - apart.x, point->y - apart.y};
      }
      lit.push_back(other);
    }
    lit.push_back(spot);
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

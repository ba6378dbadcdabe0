#include "rigs/simulated_rig.h"

#include "core/error.h"
#include "core/toml.h"
#include "rigs/camera_twin.h"
#include "rigs/laser_twin.h"
#include "rigs/stage_twin.h"
#include "rigs/transport/transport.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <utility>

namespace nacre::rigs {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// One value a laser channel, or one for all.
std::vector<double> PerChannel(const TomlTable& table,
                               const std::string& key,
                               Range range,
                               std::size_t channel_count) {
  std::vector<double> values = table.Numbers(key, range);
  if (values.size() == 1) {
    values.resize(channel_count, values.front());
  }
  if (values.size() != channel_count) {
    throw table.At(
        key, fmt::format("{} values for {} channels", values.size(), channel_count));
  }
  return values;
}

PinholeCamera ReadGeometry(const TomlTable& table) {
  PinholeCamera camera;
  camera.width_px = table.Integer("width_px", Range{16, 8192});
  camera.height_px = table.Integer("height_px", Range{16, 8192});
  const double distance_mm = table.Number("distance_mm", 600, Range{10, 1e4});
  const double field_mm = table.Number("field_mm", Range{0.1, 5 * distance_mm});
  camera.focal_px = camera.width_px * distance_mm / field_mm;
  const std::vector<double> centre_px =
      table.Numbers("centre_px",
                    {0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)},
                    Range{0, 8192});
  if (centre_px.size() != 2) {
    throw table.At("centre_px", "expected two numbers, [x, y]");
  }
  camera.centre_x_px = centre_px[0];
  camera.centre_y_px = centre_px[1];
  const Range lens{-1, 1};
  camera.lens = {.k1 = table.Number("k1", -0.12, lens),
                 .k2 = table.Number("k2", 0.02, lens),
                 .p1 = table.Number("p1", 4e-4, lens),
                 .p2 = table.Number("p2", -3e-4, lens)};
  camera.camera_from_sample =
      LookAtOrigin(distance_mm,
                   table.Number("tilt_deg", 12, Range{0, 45}) * kDegree,
                   table.Number("azimuth_deg", -90, Range{-360, 360}) * kDegree);
  return camera;
}

SensorModel ReadSensor(const TomlTable& table) {
  SensorModel sensor;
  SensorModel::Visit(sensor,
                     [&](const char* name, auto& value, Range range, const char*) {
                       using Value = std::remove_cvref_t<decltype(value)>;
                       if constexpr (std::is_same_v<Value, int>) {
                         value = table.Integer(name, value, range);
                       } else {
                         value = table.Number(name, value, range);
                       }
                     });
  return sensor;
}

CameraModel ReadCamera(const TomlTable& table, std::size_t channel_count) {
  CameraModel camera;
  camera.geometry = ReadGeometry(table);
  camera.sensor = ReadSensor(table);
  camera.electrons_per_us_per_radiance = PerChannel(
      table, "electrons_per_us_per_radiance", Range{1e-9, 1e9}, channel_count);
  table.RejectUnknownKeys();
  return camera;
}

LaserModel ReadLaser(const TomlTable& table, const std::vector<std::string>& channels) {
  LaserModel laser;
  laser.channels = channels;
  laser.power_mw = PerChannel(table, "power_mw", Range{1e-9, 1e6}, channels.size());
  laser.distance_mm = table.Number("distance_mm", laser.distance_mm, Range{1, 1e5});
  laser.separation_mm =
      table.Number("separation_mm", laser.separation_mm, Range{0, 1e3});
  laser.rotation_rad = table.Number("rotation_deg", 0.4, Range{-180, 180}) * kDegree;
  const std::vector<double> offset_mm =
      table.Numbers("offset_mm", {1.2, -0.8}, Range{-1e3, 1e3});
  if (offset_mm.size() != 2) {
    throw table.At("offset_mm", "expected two numbers, [x, y]");
  }
  laser.offset_mm = {offset_mm[0], offset_mm[1]};
  laser.max_angle_rad = table.Number("max_angle_deg", 17, Range{0.1, 60}) * kDegree;
  laser.spot_sigma_mm =
      table.Number("spot_sigma_mm", laser.spot_sigma_mm, Range{1e-3, 1e2});
  table.RejectUnknownKeys();
  return laser;
}

void ReadLamp(const std::optional<TomlTable>& table, CameraModel& camera) {
  if (!table) {
    return;
  }
  camera.lamp_electrons_per_us =
      table->Number("electrons_per_us", camera.lamp_electrons_per_us, Range{1e-9, 1e6});
  camera.card_reflectance =
      table->Number("card_reflectance", camera.card_reflectance, Range{0.01, 1});
  table->RejectUnknownKeys();
}

}  // namespace

struct SimulatedRig::Parts {
  acquire::RigDescription description;
  std::filesystem::path phantom_path;
  Phantom phantom;
  std::unique_ptr<CameraTwin> camera;
  std::unique_ptr<LaserTwin> laser;
  std::unique_ptr<StageTwin> stage;
};

SimulatedRig::SimulatedRig(const std::filesystem::path& rig_toml,
                           const SimulatedRigOptions& options)
    : parts_(std::make_unique<Parts>()) {
  Parts& parts = *parts_;
  parts.description = acquire::ReadRig(rig_toml);
  const acquire::RigDescription& rig = parts.description;
  const TomlTable simulated =
      TomlTable::FromText(rig.text, rig_toml.string()).Table("simulated");
  parts.phantom_path = rig_toml.parent_path() / simulated.Text("phantom");
  parts.phantom = ReadPhantom(parts.phantom_path);
  if (parts.phantom.channels != rig.scanner.channels) {
    throw simulated.At("phantom",
                       fmt::format("{} has other channels than this rig's scanner",
                                   parts.phantom_path.string()));
  }
  CameraModel camera =
      ReadCamera(simulated.Table("camera"), rig.scanner.channels.size());
  LaserModel laser = ReadLaser(simulated.Table("laser"), rig.scanner.channels);
  ReadLamp(simulated.FindTable("lamp"), camera);
  const auto file_seed =
      static_cast<std::uint64_t>(simulated.Integer("seed", 1, Range{0, 2e9}));
  simulated.RejectUnknownKeys();

  camera.seed = options.seed.value_or(file_seed);
  camera.board = {.columns = rig.targets.checkerboard_columns,
                  .rows = rig.targets.checkerboard_rows,
                  .square_mm = rig.targets.checkerboard_square_mm};
  camera.reference_reflectance = rig.targets.reference_reflectance;
  camera.spot_flux_mw = laser.power_mw;
  camera.spot_sigma_mm = laser.spot_sigma_mm;
  Phantom lit = parts.phantom;
  lit.beam = {.shape = BeamShape::kGaussian, .width_mm = 4 * laser.spot_sigma_mm};
  std::shared_ptr<const Transport> sample =
      MakeTransport(lit, Solver::kAuto, options.thread_count);
  auto world = std::make_shared<World>();
  parts.camera = std::make_unique<CameraTwin>(
      std::move(camera), std::move(sample), world, options.thread_count);
  parts.laser = std::make_unique<LaserTwin>(std::move(laser), world);
  parts.stage = std::make_unique<StageTwin>(std::move(world));
}

SimulatedRig::~SimulatedRig() = default;

acquire::Camera& SimulatedRig::camera() {
  return *parts_->camera;
}
acquire::Illuminator& SimulatedRig::illuminator() {
  return *parts_->laser;
}
acquire::SampleStage& SimulatedRig::stage() {
  return *parts_->stage;
}
const acquire::RigDescription& SimulatedRig::description() const {
  return parts_->description;
}
const Phantom& SimulatedRig::phantom() const {
  return parts_->phantom;
}
const std::filesystem::path& SimulatedRig::phantom_path() const {
  return parts_->phantom_path;
}

}  // namespace nacre::rigs

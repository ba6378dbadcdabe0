#include "rigs/internal/read_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <utility>

namespace nacre::rigs::internal {
namespace {

constexpr double kModelDegree = std::numbers::pi / 180;

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
                   table.Number("tilt_deg", 12, Range{0, 45}) * kModelDegree,
                   table.Number("azimuth_deg", -90, Range{-360, 360}) * kModelDegree);
  return camera;
}

// All that a model's Visit lists, by the same names.
template <class Model>
Model ReadListed(const TomlTable& table) {
  Model model;
  Model::Visit(model, [&](const char* name, auto& value, Range range, const char*) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, int>) {
      value = table.Integer(name, value, range);
    } else {
      value = table.Number(name, value, range);
    }
  });
  return model;
}

CameraModel ReadCamera(const TomlTable& table, std::size_t channel_count) {
  CameraModel camera;
  camera.geometry = ReadGeometry(table);
  camera.sensor = ReadListed<SensorModel>(table);
  camera.optics = ReadListed<OpticsModel>(table);
  camera.electrons_per_us_per_radiance = PerChannel(
      table, "electrons_per_us_per_radiance", Range{1e-9, 1e9}, channel_count);
  table.RejectUnknownKeys();
  return camera;
}

LaserModel ReadLaser(const TomlTable& table,
                     const std::vector<std::string>& channels,
                     LightNoiseModel& light_noise) {
  LaserModel laser;
  laser.channels = channels;
  laser.power_mw = PerChannel(table, "power_mw", Range{1e-9, 1e6}, channels.size());
  laser.distance_mm = table.Number("distance_mm", laser.distance_mm, Range{1, 1e5});
  laser.separation_mm =
      table.Number("separation_mm", laser.separation_mm, Range{0, 1e3});
  laser.rotation_rad =
      table.Number("rotation_deg", 0.4, Range{-180, 180}) * kModelDegree;
  const std::vector<double> offset_mm =
      table.Numbers("offset_mm", {1.2, -0.8}, Range{-1e3, 1e3});
  if (offset_mm.size() != 2) {
    throw table.At("offset_mm", "expected two numbers, [x, y]");
  }
  laser.offset_mm = {offset_mm[0], offset_mm[1]};
  laser.max_angle_rad =
      table.Number("max_angle_deg", 17, Range{0.1, 60}) * kModelDegree;
  laser.has_dac = table.Boolean("dac", false);
  laser.spot_sigma_mm =
      table.Number("spot_sigma_mm", laser.spot_sigma_mm, Range{1e-3, 1e2});
  laser.spot_aspect = table.Number("spot_aspect", 1, Range{1, 10});
  laser.spot_angle_rad =
      table.Number("spot_angle_deg", 0, Range{-180, 180}) * kModelDegree;
  laser.hysteresis_rad = 1e-3 * table.Number("hysteresis_mrad", 0, Range{-100, 100});
  light_noise = ReadListed<LightNoiseModel>(table);
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

// What filters of each colour let through of every laser, and of white light.
void ReadFilters(const std::optional<TomlTable>& table,
                 std::size_t channel_count,
                 CameraModel& camera) {
  if (!table) {
    return;
  }
  FilterModel& filters = camera.filters;
  filters.mosaic = table->Text("mosaic");
  constexpr std::array<const char*, 4> kMosaics = {"RGGB", "GRBG", "GBRG", "BGGR"};
  if (std::find(kMosaics.begin(), kMosaics.end(), filters.mosaic) == kMosaics.end()) {
    throw table->At("mosaic", "expected RGGB, GRBG, GBRG or BGGR");
  }
  const Range share{0, 1};
  filters.lasers.resize(channel_count);
  constexpr std::array<const char*, 3> kColours = {"red", "green", "blue"};
  for (std::size_t colour = 0; colour < kColours.size(); ++colour) {
    const std::vector<double> lasers =
        PerChannel(*table, kColours[colour], share, channel_count);
    for (std::size_t channel = 0; channel < channel_count; ++channel) {
      filters.lasers[channel][colour] = lasers[channel];
    }
  }
  const std::vector<double> white = table->Numbers("white", share);
  if (white.size() != filters.white.size()) {
    throw table->At("white", "expected three numbers: red, green and blue filters");
  }
  std::copy(white.begin(), white.end(), filters.white.begin());
  table->RejectUnknownKeys();
}

SamplePose ReadSample(const std::optional<TomlTable>& table, CameraModel& camera) {
  SamplePose pose;
  if (table) {
    pose.height_mm = table->Number("height_mm", 0, Range{-20, 20});
    const double tilt =
        std::tan(table->Number("tilt_deg", 0, Range{0, 20}) * kModelDegree);
    const double azimuth =
        table->Number("tilt_azimuth_deg", 0, Range{-360, 360}) * kModelDegree;
    pose.slope_x = tilt * std::cos(azimuth);
    pose.slope_y = tilt * std::sin(azimuth);
    camera.specular_reflectance =
        table->Number("specular_reflectance", 0, Range{0, 100});
    table->RejectUnknownKeys();
  }
  return pose;
}

void ReadAmbient(const std::optional<TomlTable>& table, CameraModel& camera) {
  if (table) {
    AmbientModel& ambient = camera.ambient;
    ambient.electrons_per_us = table->Number("electrons_per_us", Range{0, 1e6});
    ambient.gradient = table->Number("gradient", ambient.gradient, Range{-1, 1});
    ambient.sample_albedo =
        table->Number("sample_albedo", ambient.sample_albedo, Range{0, 1});
    table->RejectUnknownKeys();
  }
}

}  // namespace

RigModels ReadModels(const TomlTable& simulated, const acquire::RigDescription& rig) {
  RigModels models;
  CameraModel& camera = models.camera;
  const std::vector<std::string>& channels = rig.scanner.channels;
  camera = ReadCamera(simulated.Table("camera"), channels.size());
  models.laser = ReadLaser(simulated.Table("laser"), channels, camera.light_noise);
  ReadLamp(simulated.FindTable("lamp"), camera);
  ReadFilters(simulated.FindTable("filters"), channels.size(), camera);
  ReadAmbient(simulated.FindTable("ambient"), camera);
  camera.sample_pose = ReadSample(simulated.FindTable("sample"), camera);
  models.laser.sample = camera.sample_pose;
  camera.picture_period_s =
      simulated.Number("picture_period_s", camera.picture_period_s, Range{1e-4, 1e4});
  camera.seed = static_cast<std::uint64_t>(simulated.Integer("seed", 1, Range{0, 2e9}));
  if (rig.targets.patch_mm) {
    camera.patch = PatchModel{
        .centre_mm = *rig.targets.patch_mm,
        .radius_mm = simulated.Number("patch_radius_mm", 3, Range{0.01, 1e3}),
        .reflectance = rig.targets.patch_reflectance};
  }
  simulated.RejectUnknownKeys();

  camera.board = {.columns = rig.targets.checkerboard_columns,
                  .rows = rig.targets.checkerboard_rows,
                  .square_mm = rig.targets.checkerboard_square_mm};
  camera.reference_reflectance = rig.targets.reference_reflectance;
  camera.spot_flux_mw = models.laser.power_mw;
  camera.spot_sigma_mm = models.laser.RoundSigmaMm();
  return models;
}

}  // namespace nacre::rigs::internal

#include "calibrate/calibration.h"
#include "calibrate/internal/corrections_json.h"
#include "calibrate/internal/json_numbers.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::calibrate {
namespace {

constexpr const char* kFormat = "nacre calibration";
constexpr int kFormatVersion = 2;  // 1 knew no uncertainties and no corrections
constexpr int kOldestVersion = 1;

using internal::kFinite;
using internal::kNotNegative;
using internal::kPositive;
using internal::Number;

Json ToJson(const CameraGeometry& camera) {
  return Json{
      {"width_px", camera.width_px},
      {"height_px", camera.height_px},
      {"fx_px", camera.fx_px},
      {"fy_px", camera.fy_px},
      {"cx_px", camera.cx_px},
      {"cy_px", camera.cy_px},
      {"k1", camera.k1},
      {"k2", camera.k2},
      {"p1", camera.p1},
      {"p2", camera.p2},
      {"k3", camera.k3},
      {"camera_from_sample_rotation", camera.camera_from_sample_rotation},
      {"camera_from_sample_translation_mm", camera.camera_from_sample_translation_mm}};
}

Json ToJson(const ChannelResponse& channel) {
  return Json{
      {"name", channel.name},
      {"flux_scale_counts_mm2_sr_per_us", channel.flux_scale_counts_mm2_sr_per_us},
      {"flux_scale_spread", channel.flux_scale_spread},
      {"flux_scale_sigma", channel.flux_scale_sigma}};
}

template <std::size_t N>
std::array<double, N> Numbers(const Json& json,
                              const char* key,
                              const std::string& origin) {
  const std::vector<double> values = internal::List(json, key, origin);
  if (values.size() != N) {
    throw BadData(
        fmt::format("{}: field '{}' must hold {} finite numbers", origin, key, N));
  }
  std::array<double, N> array{};
  std::copy(values.begin(), values.end(), array.begin());
  return array;
}

template <std::size_t N>
std::vector<std::array<double, N>> Rows(const Json& json,
                                        const char* key,
                                        const std::string& origin) {
  return Get<std::vector<std::array<double, N>>>(json, key, origin);
}

CameraGeometry CameraFromJson(const Json& json, const std::string& origin) {
  CameraGeometry camera;
  constexpr double kMaxSide = 1 << 16;
  camera.width_px = static_cast<int>(Number(json, "width_px", origin, {1, kMaxSide}));
  camera.height_px = static_cast<int>(Number(json, "height_px", origin, {1, kMaxSide}));
  camera.fx_px = Number(json, "fx_px", origin, kPositive);
  camera.fy_px = Number(json, "fy_px", origin, kPositive);
  camera.cx_px = Number(json, "cx_px", origin);
  camera.cy_px = Number(json, "cy_px", origin);
  camera.k1 = Number(json, "k1", origin);
  camera.k2 = Number(json, "k2", origin);
  camera.p1 = Number(json, "p1", origin);
  camera.p2 = Number(json, "p2", origin);
  camera.k3 = Number(json, "k3", origin);
  camera.camera_from_sample_rotation =
      Numbers<9>(json, "camera_from_sample_rotation", origin);
  camera.camera_from_sample_translation_mm =
      Numbers<3>(json, "camera_from_sample_translation_mm", origin);
  const auto& r = camera.camera_from_sample_rotation;
  const double determinant = r[0] * (r[4] * r[8] - r[5] * r[7]) -
                             r[1] * (r[3] * r[8] - r[5] * r[6]) +
                             r[2] * (r[3] * r[7] - r[4] * r[6]);
  constexpr double kTolerance = 1e-6;
  if (!(std::abs(determinant - 1) < kTolerance)) {
    throw BadData(origin + ": field 'camera_from_sample_rotation' is no rotation");
  }
  if (!(camera.camera_from_sample_translation_mm[2] > 0)) {
    throw BadData(origin +
                  ": field 'camera_from_sample_translation_mm': the sample would lie "
                  "behind the camera");
  }
  return camera;
}

std::vector<ChannelResponse> ChannelsFromJson(const Json& json,
                                              const std::string& origin,
                                              int version) {
  std::vector<ChannelResponse> channels;
  for (const Json& channel : json) {
    channels.push_back(
        {.name = Get<std::string>(channel, "name", origin),
         .flux_scale_counts_mm2_sr_per_us =
             Number(channel, "flux_scale_counts_mm2_sr_per_us", origin, kPositive),
         .flux_scale_spread =
             Number(channel, "flux_scale_spread", origin, kNotNegative),
         .flux_scale_sigma =
             version < 2 ? 0
                         : Number(channel, "flux_scale_sigma", origin, kNotNegative)});
  }
  if (channels.empty()) {
    throw BadData(origin + ": field 'channels' is empty");
  }
  return channels;
}

// What version 1 didn't have.
void ReadUncertainties(const Json& json,
                       const std::string& origin,
                       Calibration& calibration) {
  const auto read = [&](const char* key, double& value) {
    value = Number(json, key, origin, kNotNegative);
  };
  read("dark_offset_sigma_counts", calibration.dark.offset_sigma_counts);
  read("dark_rate_sigma_counts_per_us", calibration.dark.rate_sigma_counts_per_us);
  read("gain_sigma_electrons_per_count", calibration.gain_sigma_electrons_per_count);
  read("read_noise_sigma_electrons", calibration.read_noise_sigma_electrons);
  read("focal_sigma_px", calibration.focal_sigma_px);
  read("centre_sigma_px", calibration.centre_sigma_px);
  read("height_sigma_mm", calibration.height_sigma_mm);
  read("laser_map_held_out_rms_mm", calibration.laser_map_held_out_rms_mm);
}

}  // namespace

void WriteCalibration(const std::filesystem::path& path,
                      const Calibration& calibration) {
  Json channels = Json::array();
  for (const ChannelResponse& channel : calibration.channels) {
    channels.push_back(ToJson(channel));
  }
  Json json{
      {"format", kFormat},
      {"format_version", kFormatVersion},
      {"session_rig_xxh3", calibration.session_rig_hash},
      {"camera", ToJson(calibration.camera)},
      {"reprojection_rms_px", calibration.reprojection_rms_px},
      {"dark_offset_counts", calibration.dark.offset_counts},
      {"dark_offset_sigma_counts", calibration.dark.offset_sigma_counts},
      {"dark_rate_counts_per_us", calibration.dark.rate_counts_per_us},
      {"dark_rate_sigma_counts_per_us", calibration.dark.rate_sigma_counts_per_us},
      {"gain_electrons_per_count", calibration.gain_electrons_per_count},
      {"read_noise_electrons", calibration.read_noise_electrons},
      {"gain_sigma_electrons_per_count", calibration.gain_sigma_electrons_per_count},
      {"read_noise_sigma_electrons", calibration.read_noise_sigma_electrons},
      {"focal_sigma_px", calibration.focal_sigma_px},
      {"centre_sigma_px", calibration.centre_sigma_px},
      {"height_sigma_mm", calibration.height_sigma_mm},
      {"saturation_counts", calibration.saturation_counts},
      {"channels", channels},
      {"scan_map", acquire::ToJson(calibration.scan_map)},
      {"laser_map_rms_mm", calibration.laser_map_rms_mm},
      {"laser_map_max_mm", calibration.laser_map_max_mm},
      {"laser_map_held_out_rms_mm", calibration.laser_map_held_out_rms_mm},
      {"corrections", internal::ToJson(calibration.corrections)},
      {"diagnostics",
       {{"corners_px", calibration.diagnostics.corners_px},
        {"spots_mm", calibration.diagnostics.spots_mm},
        {"response", calibration.diagnostics.response}}},
      {"provenance", ParseJson(calibration.provenance, path.string())}};
  if (calibration.captured_unix_s) {
    json["captured_unix_s"] = *calibration.captured_unix_s;
  }
  WriteJson(path, json);
}

Calibration ReadCalibration(const std::filesystem::path& path) {
  const std::string origin = path.string();
  constexpr std::uint64_t kMaxBytes = 16 << 20;
  const Json json = ParseJson(ReadFile(path, kMaxBytes), origin);
  if (Get<std::string>(json, "format", origin) != kFormat) {
    throw BadData(origin + ": not a calibration");
  }
  const int version = Get<int>(json, "format_version", origin);
  if (version < kOldestVersion || version > kFormatVersion) {
    throw BadData(fmt::format("{}: format version {}; this build reads {} to {}",
                              origin,
                              version,
                              kOldestVersion,
                              kFormatVersion));
  }
  Calibration calibration;
  calibration.session_rig_hash = Get<std::string>(json, "session_rig_xxh3", origin);
  if (json.contains("captured_unix_s")) {
    calibration.captured_unix_s = Get<std::int64_t>(json, "captured_unix_s", origin);
  }
  calibration.camera =
      CameraFromJson(Get<Json>(json, "camera", origin), origin + ": camera");
  calibration.reprojection_rms_px =
      Number(json, "reprojection_rms_px", origin, kNotNegative);
  calibration.dark.offset_counts = Number(json, "dark_offset_counts", origin);
  calibration.dark.rate_counts_per_us = Number(json, "dark_rate_counts_per_us", origin);
  calibration.gain_electrons_per_count =
      Number(json, "gain_electrons_per_count", origin, kPositive);
  calibration.read_noise_electrons =
      Number(json, "read_noise_electrons", origin, kNotNegative);
  calibration.saturation_counts = Number(json, "saturation_counts", origin, kPositive);
  calibration.channels = ChannelsFromJson(
      Get<Json>(json, "channels", origin), origin + ": channels", version);
  calibration.scan_map = acquire::ScanMapFromJson(Get<Json>(json, "scan_map", origin),
                                                  origin + ": scan_map");
  calibration.laser_map_rms_mm = Number(json, "laser_map_rms_mm", origin, kNotNegative);
  calibration.laser_map_max_mm = Number(json, "laser_map_max_mm", origin, kNotNegative);
  calibration.provenance = Get<Json>(json, "provenance", origin).dump();
  if (version >= 2) {
    ReadUncertainties(json, origin, calibration);
    calibration.corrections = internal::CorrectionsFromJson(
        Get<Json>(json, "corrections", origin),
        origin + ": corrections",
        std::int64_t{calibration.camera.width_px} * calibration.camera.height_px,
        calibration.channels.size());
    const Json diagnostics = Get<Json>(json, "diagnostics", origin);
    const std::string where = origin + ": diagnostics";
    calibration.diagnostics = {.corners_px = Rows<4>(diagnostics, "corners_px", where),
                               .spots_mm = Rows<4>(diagnostics, "spots_mm", where),
                               .response = Rows<3>(diagnostics, "response", where)};
  }
  return calibration;
}

}  // namespace nacre::calibrate

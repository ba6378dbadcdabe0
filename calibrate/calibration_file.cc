#include "calibrate/calibration.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/options.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace nacre::calibrate {
namespace {

constexpr const char* kFormat = "nacre calibration";
constexpr int kFormatVersion = 1;

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
      {"flux_scale_spread", channel.flux_scale_spread}};
}

constexpr Range kPositive{std::numeric_limits<double>::min(), 1e300};
constexpr Range kFinite{-1e300, 1e300};

double Number(const Json& json,
              const char* key,
              const std::string& origin,
              Range range = kFinite) {
  const auto value = Get<double>(json, key, origin);
  if (!(value >= range.min && value <= range.max)) {
    throw BadData(
        fmt::format("{}: field '{}': {} makes no sense there", origin, key, value));
  }
  return value;
}

template <std::size_t N>
std::array<double, N> Numbers(const Json& json,
                              const char* key,
                              const std::string& origin) {
  const auto values = Get<std::vector<double>>(json, key, origin);
  const bool finite = std::all_of(
      values.begin(), values.end(), [](double x) { return std::isfinite(x); });
  if (values.size() != N || !finite) {
    throw BadData(
        fmt::format("{}: field '{}' must hold {} finite numbers", origin, key, N));
  }
  std::array<double, N> array{};
  std::copy(values.begin(), values.end(), array.begin());
  return array;
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
                                              const std::string& origin) {
  std::vector<ChannelResponse> channels;
  for (const Json& channel : json) {
    channels.push_back(
        {.name = Get<std::string>(channel, "name", origin),
         .flux_scale_counts_mm2_sr_per_us =
             Number(channel, "flux_scale_counts_mm2_sr_per_us", origin, kPositive),
         .flux_scale_spread =
             Number(channel, "flux_scale_spread", origin, {0, kFinite.max})});
  }
  if (channels.empty()) {
    throw BadData(origin + ": field 'channels' is empty");
  }
  return channels;
}

}  // namespace

void WriteCalibration(const std::filesystem::path& path,
                      const Calibration& calibration) {
  Json channels = Json::array();
  for (const ChannelResponse& channel : calibration.channels) {
    channels.push_back(ToJson(channel));
  }
  WriteJson(path,
            Json{{"format", kFormat},
                 {"format_version", kFormatVersion},
                 {"session_rig_xxh3", calibration.session_rig_hash},
                 {"camera", ToJson(calibration.camera)},
                 {"reprojection_rms_px", calibration.reprojection_rms_px},
                 {"dark_offset_counts", calibration.dark.offset_counts},
                 {"dark_rate_counts_per_us", calibration.dark.rate_counts_per_us},
                 {"gain_electrons_per_count", calibration.gain_electrons_per_count},
                 {"read_noise_electrons", calibration.read_noise_electrons},
                 {"saturation_counts", calibration.saturation_counts},
                 {"channels", channels},
                 {"scan_map", acquire::ToJson(calibration.scan_map)},
                 {"laser_map_rms_mm", calibration.laser_map_rms_mm},
                 {"laser_map_max_mm", calibration.laser_map_max_mm},
                 {"provenance", ParseJson(calibration.provenance, path.string())}});
}

Calibration ReadCalibration(const std::filesystem::path& path) {
  const std::string origin = path.string();
  constexpr std::uint64_t kMaxBytes = 16 << 20;
  const Json json = ParseJson(ReadFile(path, kMaxBytes), origin);
  if (Get<std::string>(json, "format", origin) != kFormat) {
    throw BadData(origin + ": not a calibration");
  }
  if (const int version = Get<int>(json, "format_version", origin);
      version != kFormatVersion) {
    throw BadData(fmt::format(
        "{}: format version {}; this build reads {}", origin, version, kFormatVersion));
  }
  Calibration calibration;
  calibration.session_rig_hash = Get<std::string>(json, "session_rig_xxh3", origin);
  calibration.camera =
      CameraFromJson(Get<Json>(json, "camera", origin), origin + ": camera");
  const Range not_negative{0, kFinite.max};
  calibration.reprojection_rms_px =
      Number(json, "reprojection_rms_px", origin, not_negative);
  calibration.dark.offset_counts = Number(json, "dark_offset_counts", origin);
  calibration.dark.rate_counts_per_us = Number(json, "dark_rate_counts_per_us", origin);
  calibration.gain_electrons_per_count =
      Number(json, "gain_electrons_per_count", origin, kPositive);
  calibration.read_noise_electrons =
      Number(json, "read_noise_electrons", origin, not_negative);
  calibration.saturation_counts = Number(json, "saturation_counts", origin, kPositive);
  calibration.channels =
      ChannelsFromJson(Get<Json>(json, "channels", origin), origin + ": channels");
  calibration.scan_map = acquire::ScanMapFromJson(Get<Json>(json, "scan_map", origin),
                                                  origin + ": scan_map");
  calibration.laser_map_rms_mm = Number(json, "laser_map_rms_mm", origin, not_negative);
  calibration.laser_map_max_mm = Number(json, "laser_map_max_mm", origin, not_negative);
  calibration.provenance = Get<Json>(json, "provenance", origin).dump();
  return calibration;
}

}  // namespace nacre::calibrate

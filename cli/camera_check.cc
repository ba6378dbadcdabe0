#include "cli/camera_check.h"

#include "acquire/aravis_camera.h"
#include "acquire/rig.h"
#include "core/error.h"

#include <algorithm>
#include <fmt/format.h>
#include <numeric>
#include <optional>

namespace nacre::cli {
namespace {

using State = Finding::State;

constexpr int kAttempts = 4;
constexpr double kExposureUs = 10'000;  // where no rig says another
constexpr std::chrono::seconds kTimeoutBeyondExposure{2};

Finding Picture(const acquire::Frame& frame, const acquire::CameraInfo& info) {
  const auto [min, max] = std::minmax_element(frame.counts.begin(), frame.counts.end());
  const auto pixels = static_cast<double>(frame.counts.size());
  const double mean =
      std::accumulate(frame.counts.begin(), frame.counts.end(), 0.0) / pixels;
  const auto saturated = static_cast<double>(
      std::count(frame.counts.begin(), frame.counts.end(), (1 << info.bit_depth) - 1));
  return {"camera",
          "picture",
          fmt::format("{} us: counts {} to {}, mean {:.1f}; {:.2f} % saturated",
                      frame.exposure_us,
                      *min,
                      *max,
                      mean,
                      100 * saturated / pixels),
          State::kGood,
          ""};
}

}  // namespace

std::vector<Finding> CheckCameras() {
  std::vector<Finding> findings;
  for (const acquire::FoundCamera& camera : acquire::FindCameras()) {
    findings.push_back(
        {"camera",
         camera.id,
         fmt::format("{} {}, {} at {}",
                     camera.vendor,
                     camera.model,
                     camera.protocol,
                     camera.address),
         State::kGood,
         fmt::format("to try it: nacre doctor --camera '{}'", camera.id)});
  }
  if (findings.empty()) {
    findings.push_back(
        {"camera",
         "found",
         "none",
         State::kNote,
         "a GigE camera must be powered and have an address in the subnet of a network "
         "interface of this machine, which must let UDP port 3956 through; a USB3 "
         "camera's device node must be writable (a udev rule for its vendor)"});
  }
  return findings;
}

std::vector<Finding> TryCamera(const std::string& camera) {
  acquire::AravisOptions options{.id = camera, .pixel_format = "Mono8"};
  std::optional<double> exposure_us;
  if (camera.ends_with(".toml")) {
    const acquire::RigDescription rig = acquire::ReadRig(camera);
    if (!rig.camera.device) {
      throw UsageError(fmt::format(
          "{}: a rig of kind '{}' has no camera to be tried", camera, rig.kind));
    }
    options = *rig.camera.device;
    exposure_us = rig.camera.exposures_us.front();
  }
  acquire::AravisCamera device(options);
  const acquire::CameraInfo info = device.Info();
  const double applied_us = device.SetExposureUs(exposure_us.value_or(
      std::clamp(kExposureUs, info.min_exposure_us, info.max_exposure_us)));
  const auto timeout =
      kTimeoutBeyondExposure +
      std::chrono::milliseconds(static_cast<std::int64_t>(applied_us / 1000));
  std::optional<acquire::Frame> frame;
  for (int attempt = 0; attempt < kAttempts && !frame; ++attempt) {
    frame = device.Capture(0, timeout);
  }
  const acquire::CameraStatistics counted = device.Statistics();
  if (!frame) {
    throw DeviceError(fmt::format(
        "camera {}: no picture in {} attempts: {} incomplete, {} never came; see to "
        "{}, a packet size that the network takes, and net.core.rmem_max",
        options.id,
        kAttempts,
        counted.incomplete,
        counted.timed_out,
        options.trigger == "Software" ? "the cable"
                                      : "the pulses on " + options.trigger));
  }
  const bool none_lost = counted.incomplete + counted.timed_out == 0;
  return {{"camera",
           info.serial,
           fmt::format("{}, {} x {} pixels, {}, exposures {} to {} us",
                       info.model,
                       info.width,
                       info.height,
                       options.pixel_format,
                       info.min_exposure_us,
                       info.max_exposure_us),
           State::kGood,
           ""},
          Picture(*frame, info),
          {"camera",
           "lost before it",
           fmt::format("{} frames, {} packets",
                       counted.incomplete + counted.timed_out,
                       counted.missing_packets),
           none_lost ? State::kGood : State::kNote,
           none_lost ? ""
                     : "raise net.core.rmem_max, or lower packet_size_bytes to what "
                       "every part of the network takes"}};
}

}  // namespace nacre::cli

#pragma once

#include "acquire/capture.h"
#include "acquire/rig.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace nacre::testing {

/// A rig.toml of a small rig, with some texts replaced by others.
inline std::string RigToml(
    const std::vector<std::pair<std::string, std::string>>& edits = {}) {
  std::string text = R"(kind = "simulated"

[sample]
name = "test sample"
eta = 1.5

[grid]
points = [7, 5]
pitch_mm = 0.5
core = 3

[camera]
exposures_us = [8000, 1000]
dark_frames = 2
target_exposure_us = 2000
flat_exposures_us = [500, 1500]

[targets]
checkerboard_columns = 8
checkerboard_rows = 5
checkerboard_square_mm = 2.0
checkerboard_poses = 3
reference_reflectance = 0.99
reference_exposure_us = 4000
reference_frames = 1
laser_lattice = 5

[scanner]
mm_per_rad = 300
channels = ["R", "G"]

[schedule]
spot_spacing_cells = 4
)";
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) {
      throw LogicError("the rig has no such text: " + from);
    }
    text.replace(at, from.size(), to);
  }
  return text;
}

inline acquire::RigDescription TestRig(
    const std::vector<std::pair<std::string, std::string>>& edits = {}) {
  return acquire::ParseRig(RigToml(edits), "rig.toml");
}

/// The map of an ideal scanner, x_mm = mm_per_rad · x_rad.
inline acquire::ScanMap IdealScanMap(double mm_per_rad) {
  acquire::ScanMap map;
  map.x_rad[1] = map.y_rad[2] = 1 / mm_per_rad;
  map.x_mm[1] = map.y_mm[2] = mm_per_rad;
  return map;
}

/// What the devices of a fake rig share, and what they record for the tests.
struct FakeState {
  acquire::Target target = acquire::Target::kNothing;
  int pose = -1;
  std::vector<acquire::ScanAngle> spots;
  int channel = -1;
  double exposure_us = 0;
  std::vector<std::uint64_t> captured;  ///< numbers, lost frames too
  int blank_count = 0;
  int light_count = 0;
};

/// Counts are a pure function of the picture's number and of all that is set, so that a
/// wrong state shows in the frame.
class FakeCamera final : public acquire::Camera {
 public:
  explicit FakeCamera(FakeState& state) : state_(state) {}

  acquire::CameraInfo Info() const override {
    return {.model = "fake camera",
            .serial = "1",
            .width = 6,
            .height = 4,
            .bit_depth = 12,
            .min_exposure_us = 10,
            .max_exposure_us = 1e6};
  }
  double SetExposureUs(double exposure_us) override {
    return state_.exposure_us = exposure_us + 0.25;  // as applied
  }
  std::optional<acquire::Frame> Capture(std::uint64_t picture_number,
                                        std::chrono::milliseconds) override {
    state_.captured.push_back(picture_number);
    if (before_capture) {
      before_capture(picture_number);
    }
    if (lose_next > 0) {
      --lose_next;
      return std::nullopt;
    }
    std::uint64_t key = Hash64(&picture_number, sizeof picture_number);
    const auto mix = [&key](const auto& value) {
      key = key * 31 + Hash64(&value, sizeof value);
    };
    mix(state_.target);
    mix(state_.pose);
    mix(state_.channel);
    mix(state_.exposure_us);
    for (const acquire::ScanAngle& spot : state_.spots) {
      mix(spot.x_rad);
      mix(spot.y_rad);
    }
    RandomStream random(key, 0);
    acquire::Frame frame{.width = 6,
                         .height = 4,
                         .counts = std::vector<std::uint16_t>(24),
                         .exposure_us = state_.exposure_us,
                         .frame_id = picture_number,
                         .timestamp_ns = 1000};
    for (std::uint16_t& count : frame.counts) {
      count = static_cast<std::uint16_t>(random() >> 20);
    }
    if (edit_frame) {
      edit_frame(frame);
    }
    return frame;
  }

  int lose_next = 0;
  std::function<void(std::uint64_t)> before_capture;
  std::function<void(acquire::Frame&)> edit_frame;

 private:
  FakeState& state_;
};

class FakeLaser final : public acquire::Illuminator {
 public:
  explicit FakeLaser(FakeState& state) : state_(state) {}
  acquire::IlluminatorInfo Info() const override {
    return {.model = "fake laser",
            .serial = "2",
            .channels = {"R", "G"},
            .max_angle_rad = 0.3};
  }
  void Light(std::span<const acquire::ScanAngle> spots, int channel) override {
    state_.spots.assign(spots.begin(), spots.end());
    state_.channel = channel;
    ++state_.light_count;
  }
  void Blank() noexcept override {
    state_.spots.clear();
    state_.channel = -1;
    ++state_.blank_count;
  }

 private:
  FakeState& state_;
};

class FakeStage final : public acquire::SampleStage {
 public:
  explicit FakeStage(FakeState& state) : state_(state) {}
  void Place(acquire::Target target, int pose) override {
    if (!state_.spots.empty()) {
      throw LogicError("the laser is on while the sample is changed");
    }
    state_.target = target;
    state_.pose = pose;
  }

 private:
  FakeState& state_;
};

struct FakeRig {
  FakeState state;
  FakeCamera camera{state};
  FakeLaser laser{state};
  FakeStage stage{state};
  acquire::Devices devices() { return {camera, laser, stage}; }
  acquire::SessionManifest Manifest(const acquire::RigDescription& rig) const {
    return acquire::MakeManifest(rig, camera.Info(), laser.Info(), 1);
  }
};

}  // namespace nacre::testing

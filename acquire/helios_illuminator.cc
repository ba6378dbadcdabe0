#include "acquire/helios_illuminator.h"

#include "acquire/helios_dac.h"
#include "acquire/laser_feeder.h"
#include "core/error.h"

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <fmt/format.h>
#include <mutex>
#include <thread>

namespace nacre::acquire {
namespace {

// Between two looks at the DAC: a fraction of a frame.
constexpr std::chrono::microseconds kBusyPause{1000};
constexpr std::chrono::milliseconds kIdlePause{20};

double NowS() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::uint8_t Level(double share) {
  return static_cast<std::uint8_t>(std::floor(share * 255));
}

// Steps whose angles lie within; the inverse of rounding to the nearest.
std::array<int, 2> StepsWithin(const ScanField& field, std::array<double, 2> rad) {
  std::array<int, 2> steps{field.StepFromAngle(rad[0]), field.StepFromAngle(rad[1])};
  steps[0] += field.AngleFromStep(steps[0]) < rad[0] ? 1 : 0;
  steps[1] -= field.AngleFromStep(steps[1]) > rad[1] ? 1 : 0;
  return steps;
}

}  // namespace

LaserLimits MakeLimits(const HeliosOptions& options, const SafetyDescription& safety) {
  const ScanField field{options.max_angle_rad};
  const std::uint8_t level = Level(safety.max_power);
  return {.x_steps = StepsWithin(field, safety.field_x_rad),
          .y_steps = StepsWithin(field, safety.field_y_rad),
          .max_level = {level, level, level},
          .max_dwell_us = safety.max_dwell_us,
          .max_duty = safety.max_duty,
          .max_lit_s = safety.max_lit_s};
}

struct HeliosIlluminator::Parts {
  Parts(const HeliosOptions& given,
        const SafetyDescription& safety,
        const SpotTiming& its_timing,
        std::vector<std::string> its_channels)
      : options(given),
        field{given.max_angle_rad},
        timing(its_timing),
        channels(std::move(its_channels)),
        feeder({.limits = MakeLimits(given, safety),
                .dark = MakeDarkFrame(given.points_per_s),
                .reconnect_s = given.reconnect_s,
                .open =
                    [this] {
                      auto dac = std::make_unique<HeliosDac>(options.name);
                      if (dac_name.empty()) {
                        dac_name = dac->name();
                      }
                      return dac;
                    },
                .clock_s = NowS}),
        thread([this](const std::stop_token& stop) { Run(stop); }) {}

  void Run(const std::stop_token& stop) {
    std::unique_lock lock(mutex);
    while (!stop.stop_requested()) {
      feeder.Step();
      ++steps;
      changed.notify_all();
      const bool busy = feeder.HasDac() && !(IsDark() && feeder.IsSteady());
      woken.wait_for(
          lock, stop, busy ? kBusyPause : kIdlePause, [this] { return asked; });
      asked = false;
    }
  }

  bool IsDark() const { return feeder.state() != LaserState::kLit && !wants_light; }

  // The DAC is asked after this was called: it may have gone before the last answer.
  std::int64_t CountInterruptions() {
    std::unique_lock lock(mutex);
    if (wants_light) {
      const std::int64_t wanted = steps + 1;
      asked = true;
      woken.notify_all();
      changed.wait(lock, [&] { return steps >= wanted; });
    }
    return feeder.CountInterruptions();
  }

  // The feeder is told something by `tell` and goes on at once.
  template <class Tell>
  void Ask(const Tell& tell) {
    const std::lock_guard lock(mutex);
    tell();
    asked = true;
    woken.notify_all();
  }

  void AwaitSteady() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [this] { return feeder.IsSteady() || feeder.failure(); });
    if (feeder.failure()) {
      throw DeviceError(*feeder.failure());
    }
  }

  // An error must not be answered by darkness that is waited for in vain: the light
  // ends by itself soon.
  void AwaitDark() noexcept {
    std::unique_lock lock(mutex);
    while (!feeder.IsSteady() && NowS() < feeder.dark_by_s()) {
      changed.wait_for(lock, kBusyPause);
    }
  }

  const HeliosOptions options;
  const ScanField field;
  const SpotTiming timing;
  const std::vector<std::string> channels;
  std::string dac_name;

  mutable std::mutex mutex;  // of all below
  std::condition_variable_any woken;
  std::condition_variable changed;
  bool asked = false;
  bool wants_light = false;
  std::int64_t steps = 0;
  LaserFeeder feeder;
  std::jthread thread;
};

HeliosIlluminator::HeliosIlluminator(const HeliosOptions& options,
                                     const SafetyDescription& safety,
                                     const SpotTiming& timing,
                                     std::vector<std::string> channels)
    : parts_(std::make_unique<Parts>(options, safety, timing, std::move(channels))) {
  Expect(options.power.size() == parts_->channels.size(), "a power for each channel");
}

HeliosIlluminator::~HeliosIlluminator() {
  Disarm();
}

void HeliosIlluminator::Arm() {
  parts_->Ask([&] { parts_->feeder.Arm(); });
}
void HeliosIlluminator::Disarm() noexcept {
  parts_->Ask([&] {
    parts_->wants_light = false;
    parts_->feeder.Disarm();
  });
  parts_->AwaitDark();
}
void HeliosIlluminator::EmergencyStop(const std::string& reason) noexcept {
  parts_->Ask([&] {
    parts_->wants_light = false;
    parts_->feeder.EmergencyStop(reason);
  });
}
void HeliosIlluminator::ClearEmergencyStop() noexcept {
  parts_->Ask([&] { parts_->feeder.ClearEmergencyStop(); });
}
LaserState HeliosIlluminator::state() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->feeder.state();
}

IlluminatorInfo HeliosIlluminator::Info() const {
  return {.model = "Helios laser DAC",
          .serial = parts_->dac_name,
          .channels = parts_->channels,
          .max_angle_rad = parts_->field.max_angle_rad};
}

void HeliosIlluminator::Light(std::span<const ScanAngle> spots, int channel) {
  Parts& parts = *parts_;
  if (channel < 0 || channel >= static_cast<int>(parts.channels.size())) {
    throw DeviceError(fmt::format("the laser was asked for channel {}; it has {}",
                                  channel,
                                  parts.channels.size()));
  }
  for (const ScanAngle& angle : spots) {
    if (!(std::abs(angle.x_rad) <= parts.field.max_angle_rad &&
          std::abs(angle.y_rad) <= parts.field.max_angle_rad)) {
      throw DeviceError(
          fmt::format("the laser was asked for scan angles ({:.4f}, {:.4f}) rad; it "
                      "reaches ±{:.4f} rad. Is the grid larger than the scan field?",
                      angle.x_rad,
                      angle.y_rad,
                      parts.field.max_angle_rad));
    }
  }
  if (spots.empty()) {
    Blank();
    return;
  }
  std::array<std::uint8_t, 3> level{};
  const auto c = static_cast<std::size_t>(channel);
  level[c] = Level(parts.options.power[c]);
  const LaserFrame frame = MakeSpotFrame(parts.timing, parts.field, spots, level);
  parts.Ask([&] {
    parts.feeder.Show(frame);
    parts.wants_light = true;
  });
  parts.AwaitSteady();
}

void HeliosIlluminator::Blank() noexcept {
  parts_->Ask([&] {
    parts_->wants_light = false;
    parts_->feeder.ShowNothing();
  });
  parts_->AwaitDark();
}

void HeliosIlluminator::AwaitSteady() {
  parts_->AwaitSteady();
}

std::int64_t HeliosIlluminator::Interruptions() const {
  return parts_->CountInterruptions();
}

}  // namespace nacre::acquire

#include "acquire/rig_light.h"

#include "acquire/schedule.h"
#include "core/error.h"

#include <algorithm>
#include <fmt/format.h>
#include <numbers>
#include <optional>

namespace nacre::acquire {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

std::vector<double> ReadPower(const TomlTable& table, std::size_t channel_count) {
  std::vector<double> power = table.Numbers("power", Range{0, 1});
  if (power.size() == 1) {
    power.resize(channel_count, power.front());
  }
  if (power.size() != channel_count || channel_count > 3) {
    throw table.At("power",
                   fmt::format("{} values for {} channels; red, green and blue at most",
                               power.size(),
                               channel_count));
  }
  return power;
}

HeliosOptions ReadDevice(const TomlTable& table, std::size_t channel_count) {
  HeliosOptions device;
  table.Has("kind");  // which is why this is called
  device.name = table.Text("name", "");
  // Below, a frame has too few points to share out; above, no Helios goes.
  device.points_per_s =
      table.Integer("points_per_s", device.points_per_s, Range{1000, 65'535});
  device.settle_us = table.Number("settle_us", device.settle_us, Range{0, 20'000});
  device.max_angle_rad = table.Number("max_angle_deg", Range{0.1, 60}) * kDegree;
  device.power = ReadPower(table, channel_count);
  device.reconnect_s =
      table.Number("reconnect_s", device.reconnect_s, Range{0, 86'400});
  table.RejectUnknownKeys();
  return device;
}

std::array<double, 2> ReadField(const TomlTable& table,
                                const std::string& key,
                                double max_angle_rad) {
  const std::vector<double> ends_deg = table.Numbers(key, Range{-60, 60});
  if (ends_deg.size() != 2 || !(ends_deg[0] < ends_deg[1])) {
    throw table.At(key, "expected two angles, the lesser first");
  }
  const std::array<double, 2> ends_rad{ends_deg[0] * kDegree, ends_deg[1] * kDegree};
  if (ends_rad[0] < -max_angle_rad || ends_rad[1] > max_angle_rad) {
    throw table.At(key,
                   fmt::format("goes beyond ±{:.4g}, max_angle_deg of the illuminator",
                               max_angle_rad / kDegree));
  }
  return ends_rad;
}

SafetyDescription ReadSafety(const TomlTable& table, double max_angle_rad) {
  SafetyDescription safety;
  safety.field_x_rad = ReadField(table, "field_x_deg", max_angle_rad);
  safety.field_y_rad = ReadField(table, "field_y_deg", max_angle_rad);
  safety.max_power = table.Number("max_power", Range{0, 1});
  safety.max_dwell_us = table.Number("max_dwell_us", Range{1, 20'000});
  safety.max_duty = table.Number("max_duty", Range{1e-4, 1});
  safety.max_lit_s = table.Number("max_lit_s", Range{0.1, 36'000});
  table.RejectUnknownKeys();
  return safety;
}

int MostSpots(const Schedule& schedule, const RigDescription& rig) {
  std::size_t most = schedule.lattice().size();
  const std::size_t patch = rig.targets.patch_mm ? 1 : 0;
  for (int group = 0; group < schedule.group_count(); ++group) {
    most = std::max(most, schedule.Group(group).size() + patch);
  }
  return static_cast<int>(most);
}

// The lattice is known before the laser map is, and reaches as far as the grid.
void CheckField(const TomlTable& table, const Schedule& schedule, double x, double y) {
  for (const ScanAngle& angle : schedule.lattice()) {
    const bool is_x = std::abs(angle.x_rad) > x;
    if (is_x || std::abs(angle.y_rad) > y) {
      throw table.At(is_x ? "field_x_deg" : "field_y_deg",
                     fmt::format("the grid asks for ±{:.4g} degrees by mm_per_rad",
                                 std::abs(is_x ? angle.x_rad : angle.y_rad) / kDegree));
    }
  }
}

double Reach(const std::array<double, 2>& field_rad) {
  return std::min(-field_rad[0], field_rad[1]);
}

void CheckLimits(const TomlTable& table,
                 const LightDescription& light,
                 const SpotTiming& timing) {
  const double most =
      *std::max_element(light.device.power.begin(), light.device.power.end());
  if (most > light.safety.max_power) {
    throw table.At("max_power",
                   fmt::format("the illuminator's power is {}, which is more", most));
  }
  if (timing.DwellUs() > light.safety.max_dwell_us) {
    throw table.At("max_dwell_us",
                   fmt::format("the exposures and spots of this rig make a dwell of "
                               "{:.0f} us, which is longer",
                               timing.DwellUs()));
  }
  if (timing.Share() > light.safety.max_duty) {
    throw table.At("max_duty",
                   fmt::format("the exposures and spots of this rig light a place for "
                               "{:.4f} of the time, which is more",
                               timing.Share()));
  }
}

std::vector<double> LitExposures(const RigDescription& rig) {
  std::vector<double> exposures_us = rig.camera.exposures_us;
  exposures_us.push_back(rig.targets.reference_exposure_us);
  exposures_us.insert(exposures_us.end(),
                      rig.targets.glare_exposures_us.begin(),
                      rig.targets.glare_exposures_us.end());
  return exposures_us;
}

// All that are lit, in whole frames of the projector: it dims by switching within each.
void CheckExposures(const TomlTable& table,
                    double refresh_hz,
                    const RigDescription& rig) {
  for (const double exposure_us : LitExposures(rig)) {
    const double frames = exposure_us * 1e-6 * refresh_hz;
    if (frames < 0.999 || std::abs(frames - std::round(frames)) > 1e-3 * frames) {
      throw table.At("refresh_hz",
                     fmt::format("an exposure of {} us is {:.3f} frames of the "
                                 "projector; all that it lights must be whole ones",
                                 exposure_us,
                                 frames));
    }
  }
}

ProjectorOptions ReadProjector(const TomlTable& table, const RigDescription& rig) {
  ProjectorOptions projector;
  projector.display = table.Integer("display", projector.display, Range{0, 15});
  projector.max_angle_rad = table.Number("max_angle_deg", Range{0.1, 60}) * kDegree;
  projector.field_x_rad = ReadField(table, "field_x_deg", projector.max_angle_rad);
  projector.field_y_rad = ReadField(table, "field_y_deg", projector.max_angle_rad);
  projector.spot_px = table.Integer("spot_px", projector.spot_px, Range{1, 999});
  if (projector.spot_px % 2 == 0) {
    throw table.At("spot_px", "is even; a spot has a pixel in its middle");
  }
  projector.power = ReadPower(table, rig.scanner.channels.size());
  projector.refresh_hz =
      table.Number("refresh_hz", projector.refresh_hz, Range{10, 1000});
  projector.settle_ms =
      table.Number("settle_ms", projector.settle_ms, Range{0, 10'000});
  table.RejectUnknownKeys();
  CheckExposures(table, projector.refresh_hz, rig);
  CheckField(
      table, Schedule(rig), Reach(projector.field_x_rad), Reach(projector.field_y_rad));
  return projector;
}

}  // namespace

void ReadLight(const TomlTable& root, RigDescription& rig) {
  const std::optional<TomlTable> illuminator = root.FindTable("illuminator");
  const std::optional<TomlTable> safety = root.FindTable("safety");
  if (!illuminator && !safety) {
    return;
  }
  if (illuminator && illuminator->Has("device")) {
    const TomlTable device = illuminator->Table("device");
    const std::string kind = device.Text("kind", "helios");
    if (kind != "helios" && kind != "projector") {
      throw device.At("kind", fmt::format("'{}' isn't one of helios, projector", kind));
    }
    if (kind == "projector") {
      if (safety) {
        throw root.At("safety", "is for lasers; a projector has its field of its own");
      }
      illuminator->RejectUnknownKeys();
      rig.projector = ReadProjector(device, rig);
      return;
    }
  }
  if (!illuminator || !safety) {
    throw root.At(illuminator ? "illuminator" : "safety",
                  illuminator ? "there is no [safety] to it"
                              : "there is no [illuminator.device] to it");
  }
  const TomlTable device = illuminator->Table("device");
  illuminator->RejectUnknownKeys();
  LightDescription light;
  light.device = ReadDevice(device, rig.scanner.channels.size());
  light.safety = ReadSafety(*safety, light.device.max_angle_rad);
  rig.illuminator = light;
  const Schedule schedule(rig);
  CheckField(*safety,
             schedule,
             Reach(light.safety.field_x_rad),
             Reach(light.safety.field_y_rad));
  try {
    CheckLimits(*safety, light, PlanSpots(rig));
  } catch (const Error& e) {
    if (e.code() == ExitCode::kBadData) {
      throw;
    }
    throw device.At("settle_us", e.what());
  }
}

SpotTiming PlanSpots(const RigDescription& rig) {
  Expect(rig.illuminator.has_value(), "a rig with an illuminator");
  return PlanSpots(LitExposures(rig),
                   MostSpots(Schedule(rig), rig),
                   rig.illuminator->device.settle_us,
                   rig.illuminator->device.points_per_s);
}

}  // namespace nacre::acquire

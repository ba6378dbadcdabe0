#pragma once

#include "acquire/camera.h"
#include "acquire/illuminator.h"
#include "acquire/rig.h"
#include "acquire/sample_stage.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

namespace nacre::cli {

struct RigDevicesOptions {
  std::optional<std::uint64_t> seed = std::nullopt;  ///< of a simulated rig
  int thread_count = 0;
  bool arm_laser = false;  ///< of a hardware rig; without it there is no light
  bool dry_run = false;    ///< the file's [simulated] rig, whatever its kind
};

/// The devices of a rig, open.
class RigDevices {
 public:
  virtual ~RigDevices() = default;
  virtual const acquire::RigDescription& description() const = 0;
  virtual acquire::Camera& camera() = 0;
  virtual acquire::Illuminator& illuminator() = 0;
  virtual acquire::SampleStage& stage() = 0;
};

/// Opens what rig.toml describes. A rig of kind "hardware" needs a person: the laser is
/// armed only if that was asked for, and each change of the target is asked for on
/// stderr and answered by a line on stdin. Throws UsageError if the laser isn't to be
/// armed, DeviceError for a device that can't be had or has no driver in this build.
std::unique_ptr<RigDevices> OpenRigDevices(const std::filesystem::path& rig_toml,
                                           const RigDevicesOptions& options);

}  // namespace nacre::cli

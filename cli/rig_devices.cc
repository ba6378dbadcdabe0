#include "cli/rig_devices.h"

#include "cli/hardware_rig.h"
#include "core/error.h"
#include "rigs/simulated_rig.h"

#include <fmt/format.h>

namespace nacre::cli {
namespace {

class SimulatedDevices final : public RigDevices {
 public:
  SimulatedDevices(const std::filesystem::path& rig_toml,
                   const RigDevicesOptions& options)
      : rig_(rig_toml, {.seed = options.seed, .thread_count = options.thread_count}) {}
  const acquire::RigDescription& description() const override {
    return rig_.description();
  }
  acquire::Camera& camera() override { return rig_.camera(); }
  acquire::Illuminator& illuminator() override { return rig_.illuminator(); }
  acquire::SampleStage& stage() override { return rig_.stage(); }

 private:
  rigs::SimulatedRig rig_;
};

}  // namespace

std::unique_ptr<RigDevices> OpenRigDevices(const std::filesystem::path& rig_toml,
                                           const RigDevicesOptions& options) {
  if (acquire::ReadRig(rig_toml).kind == "simulated" || options.dry_run) {
    return std::make_unique<SimulatedDevices>(rig_toml, options);
  }
#if defined(NACRE_HAS_ARAVIS) && defined(NACRE_HAS_HELIOS)
  return OpenHardwareRig(rig_toml, options.arm_laser);
#else
  throw DeviceError(
      fmt::format("{}: this build lacks a driver for the rig's camera or its laser; "
                  "configure it with NACRE_WITH_ARAVIS and NACRE_WITH_HELIOS",
                  rig_toml.string()));
#endif
}

}  // namespace nacre::cli

#pragma once

#include "rigs/gige_camera_twin.h"
#include "rigs/helios_dac_twin.h"
#include "rigs/simulated_rig.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

namespace nacre::rigs {

/// The simulated rig of a rig file behind emulated devices: a GigE camera on the
/// loopback interface, which sees what a Helios DAC on an emulated USB puts out at the
/// instant of the trigger. Any program may drive them, by its true drivers.
///
/// The light of a picture is that of the frame which is put out when it is triggered:
/// its spots in the order of their visits. Spots of one frame must be lit for equally
/// long, as the simulated rig has them.
class EmulatedRig {
 public:
  /// `rig_toml` must have a table [simulated]; whose devices it says to use is left to
  /// the program that drives them.
  explicit EmulatedRig(const std::filesystem::path& rig_toml,
                       std::optional<std::uint64_t> seed = std::nullopt);
  ~EmulatedRig();
  EmulatedRig(const EmulatedRig&) = delete;
  EmulatedRig& operator=(const EmulatedRig&) = delete;

  GigeCameraTwin& camera() { return *camera_; }
  HeliosDacTwin& dac() { return *dac_; }
  void Place(acquire::Target target, int pose);

  /// Pictures of frames whose spots weren't lit for equally long.
  std::int64_t uneven_pictures() const;

 private:
  std::vector<std::uint16_t> Picture(std::uint64_t number, double exposure_us);
  void SetLight();

  mutable std::mutex mutex_;  // of all that is simulated
  SimulatedRig simulated_;
  std::shared_ptr<const acquire::LaserFrame> shown_;
  std::int64_t uneven_pictures_ = 0;
  std::unique_ptr<HeliosDacTwin> dac_;
  std::unique_ptr<GigeCameraTwin> camera_;
};

}  // namespace nacre::rigs

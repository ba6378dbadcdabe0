#include "rigs/simulated_rig.h"

#include "core/error.h"
#include "core/toml.h"
#include "rigs/camera_twin.h"
#include "rigs/internal/read_models.h"
#include "rigs/laser_twin.h"
#include "rigs/stage_twin.h"
#include "rigs/transport/transport.h"

#include <fmt/format.h>
#include <utility>

namespace nacre::rigs {
struct SimulatedRig::Parts {
  acquire::RigDescription description;
  std::filesystem::path phantom_path;
  Phantom phantom;
  std::unique_ptr<CameraTwin> camera;
  std::unique_ptr<LaserTwin> laser;
  std::unique_ptr<StageTwin> stage;
};

SimulatedRig::SimulatedRig(const std::filesystem::path& rig_toml,
                           const SimulatedRigOptions& options)
    : parts_(std::make_unique<Parts>()) {
  Parts& parts = *parts_;
  parts.description = acquire::ReadRig(rig_toml);
  const acquire::RigDescription& rig = parts.description;
  const TomlTable simulated =
      TomlTable::FromText(rig.text, rig_toml.string()).Table("simulated");
  parts.phantom_path = rig_toml.parent_path() / simulated.Text("phantom");
  parts.phantom = ReadPhantom(parts.phantom_path);
  if (parts.phantom.channels != rig.scanner.channels) {
    throw simulated.At("phantom",
                       fmt::format("{} has other channels than this rig's scanner",
                                   parts.phantom_path.string()));
  }
  internal::RigModels models = internal::ReadModels(simulated, rig);
  models.camera.seed = options.seed.value_or(models.camera.seed);
  Phantom lit = parts.phantom;
  lit.beam = {.shape = BeamShape::kGaussian,
              .width_mm = 4 * models.camera.spot_sigma_mm};
  std::shared_ptr<const Transport> sample =
      MakeTransport(lit, Solver::kAuto, options.thread_count);
  auto world = std::make_shared<World>();
  parts.camera = std::make_unique<CameraTwin>(
      std::move(models.camera), std::move(sample), world, options.thread_count);
  parts.laser = std::make_unique<LaserTwin>(std::move(models.laser), world);
  parts.stage = std::make_unique<StageTwin>(std::move(world));
}

SimulatedRig::~SimulatedRig() = default;

acquire::Camera& SimulatedRig::camera() {
  return *parts_->camera;
}
acquire::Illuminator& SimulatedRig::illuminator() {
  return *parts_->laser;
}
acquire::SampleStage& SimulatedRig::stage() {
  return *parts_->stage;
}
const acquire::RigDescription& SimulatedRig::description() const {
  return parts_->description;
}
const Phantom& SimulatedRig::phantom() const {
  return parts_->phantom;
}
const std::filesystem::path& SimulatedRig::phantom_path() const {
  return parts_->phantom_path;
}

}  // namespace nacre::rigs

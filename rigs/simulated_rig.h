#pragma once

#include "acquire/camera.h"
#include "acquire/illuminator.h"
#include "acquire/rig.h"
#include "acquire/sample_stage.h"
#include "rigs/phantom.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

namespace nacre::rigs {

struct SimulatedRigOptions {
  std::optional<std::uint64_t> seed =
      std::nullopt;      ///< instead of the file's [simulated] seed
  int thread_count = 0;  ///< 0: all cores; changes no picture
};

/// A rig that exists only in a rig file of kind "simulated": its [simulated] table says
/// what the rest of the software can only find out from pictures. The format is
/// described in rigs/README.md.
class SimulatedRig {
 public:
  /// Throws BadData "file:line: key: …" as ReadRig does, for [simulated] and its
  /// phantom too.
  explicit SimulatedRig(const std::filesystem::path& rig_toml,
                        const SimulatedRigOptions& options = {});
  ~SimulatedRig();
  SimulatedRig(const SimulatedRig&) = delete;
  SimulatedRig& operator=(const SimulatedRig&) = delete;

  acquire::Camera& camera();
  acquire::Illuminator& illuminator();
  acquire::SampleStage& stage();
  const acquire::RigDescription& description() const;

  /// The truth. For comparing results with; no stage may be given it.
  const Phantom& phantom() const;
  const std::filesystem::path& phantom_path() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace nacre::rigs

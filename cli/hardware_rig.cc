#include "cli/hardware_rig.h"

#include "acquire/aravis_camera.h"
#include "acquire/helios_illuminator.h"
#include "acquire/rig_light.h"
#ifdef NACRE_HAS_PROJECTOR
#include "acquire/projector_illuminator.h"
#endif
#include "cli/command_line.h"
#include "core/error.h"

#include <fmt/format.h>
#include <iostream>
#include <poll.h>
#include <string>
#include <termios.h>
#include <unistd.h>

namespace nacre::cli {
namespace {

std::string WhatToDo(acquire::Target target, int pose) {
  using acquire::Target;
  switch (target) {
    case Target::kNothing:
      return "put the lens cap on";
    case Target::kCheckerboard:
      return pose == 0
                 ? "lay the checkerboard flat into the sample plane, its middle on "
                   "the origin, and switch the lamp on"
                 : "tilt the checkerboard another way";
    case Target::kFlat:
      return "put the white card in";
    case Target::kReference:
      return "switch the lamp off, lay the reflectance standard into the sample plane";
    case Target::kGlare:
      return "leave the reflectance standard where it is";
    case Target::kAmbient:
      return pose == 0 ? "leave the reflectance standard where it is"
                       : "lay the sample into the sample plane";
    case Target::kSample:
      return "lay the sample into the sample plane";
  }
  throw LogicError("a target of no kind");
}

// Waits for the next line on standard input; false at its end. Unlike std::getline it
// is ended by Ctrl-C.
bool AwaitEnter() {
  constexpr int kPauseMs = 200;
  for (char c = 0; c != '\n';) {
    pollfd ready{STDIN_FILENO, POLLIN, 0};
    const int count = ::poll(&ready, 1, kPauseMs);
    if (InterruptRequested()) {
      throw Interrupted("stopped while waiting for Enter; --resume goes on");
    }
    if (count == 1 && ::read(STDIN_FILENO, &c, 1) <= 0) {
      return false;
    }
  }
  return true;
}

// Asks the person at the rig. The laser is dark meanwhile.
class AskingStage final : public acquire::SampleStage {
 public:
  void Place(acquire::Target target, int pose) override {
    ::tcflush(STDIN_FILENO, TCIFLUSH);  // an Enter of before answers nothing
    std::cerr << (::isatty(STDERR_FILENO) == 1 ? "\r\033[K" : "")  // of progress
              << fmt::format("place: {} {}: {}, then press Enter\n",
                             acquire::Name(target),
                             pose,
                             WhatToDo(target, pose))
              << std::flush;
    if (!AwaitEnter()) {
      throw Interrupted("nobody answers on standard input; --resume goes on");
    }
  }
};

std::unique_ptr<acquire::Illuminator> OpenLight(const acquire::RigDescription& rig) {
  if (rig.projector) {
#ifdef NACRE_HAS_PROJECTOR
    return std::make_unique<acquire::ProjectorIlluminator>(*rig.projector,
                                                           rig.scanner.channels);
#else
    throw DeviceError(
        fmt::format("{}: this build has no driver for projectors; configure it with "
                    "NACRE_WITH_PROJECTOR",
                    rig.path.string()));
#endif
  }
  auto laser = std::make_unique<acquire::HeliosIlluminator>(rig.illuminator->device,
                                                            rig.illuminator->safety,
                                                            acquire::PlanSpots(rig),
                                                            rig.scanner.channels);
  laser->Arm();
  return laser;
}

class HardwareRig final : public RigDevices {
 public:
  explicit HardwareRig(acquire::RigDescription description)
      : description_(std::move(description)),
        camera_(*description_.camera.device),
        light_(OpenLight(description_)) {}

  const acquire::RigDescription& description() const override { return description_; }
  acquire::Camera& camera() override { return camera_; }
  acquire::Illuminator& illuminator() override { return *light_; }
  acquire::SampleStage& stage() override { return stage_; }

 private:
  const acquire::RigDescription description_;
  acquire::AravisCamera camera_;
  AskingStage stage_;
  std::unique_ptr<acquire::Illuminator> light_;  // last, so that it is the first to end
};

}  // namespace

std::unique_ptr<RigDevices> OpenHardwareRig(const std::filesystem::path& rig_toml,
                                            bool arm_laser) {
  acquire::RigDescription description = acquire::ReadRig(rig_toml);
  if (!description.illuminator && !description.projector) {
    throw BadData(
        fmt::format("{}: illuminator: a capture needs [illuminator.device]; `nacre "
                    "doctor --camera {}` tries the camera alone",
                    rig_toml.string(),
                    rig_toml.string()));
  }
  if (description.illuminator && !arm_laser) {
    throw UsageError(fmt::format(
        "{}: a capture with this rig switches a laser on. Once nobody is in "
        "its way and goggles are worn, say so by --arm-laser",
        rig_toml.string()));
  }
  return std::make_unique<HardwareRig>(std::move(description));
}

}  // namespace nacre::cli

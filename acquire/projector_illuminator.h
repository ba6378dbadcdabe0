#pragma once

#include "acquire/illuminator.h"
#include "acquire/projector_options.h"

#include <memory>
#include <string>
#include <vector>

namespace nacre::acquire {

/// A video projector as a source of spots: a window that fills a display, black but for
/// discs of one channel. For whoever has no laser; no light of it needs arming.
///
/// A thread of its own owns the window. If somebody closes, hides or resizes it, that
/// is an interruption, and all calls but Blank throw DeviceError from then on.
class ProjectorIlluminator final : public Illuminator {
 public:
  /// Opens the window, black. Throws DeviceError, with the displays that there are.
  ProjectorIlluminator(const ProjectorOptions& options,
                       std::vector<std::string> channels);
  /// Black, then closed.
  ~ProjectorIlluminator() override;
  ProjectorIlluminator(const ProjectorIlluminator&) = delete;
  ProjectorIlluminator& operator=(const ProjectorIlluminator&) = delete;

  IlluminatorInfo Info() const override;
  /// Leaves the projector black if it throws.
  void Light(std::span<const ScanAngle> spots, int channel) override;
  void Blank() noexcept override;
  /// Returns once the last picture was handed over settle_ms ago.
  void AwaitSteady() override;
  std::int64_t Interruptions() const override;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace nacre::acquire

#include "acquire/internal/rig_state.h"

#include "core/error.h"

#include <algorithm>
#include <fmt/format.h>
#include <vector>

namespace nacre::acquire::internal {
namespace {

constexpr int kAttempts = 4;  // a lost frame is asked for three times again
constexpr int kMaxLightFailures = 100;
constexpr std::chrono::seconds kTimeoutBeyondExposure{5};

}  // namespace

RigState::RigState(const SessionWriter& session,
                   const Devices& devices,
                   const ScanMap* map)
    : session_(session), devices_(devices), map_(map) {
  devices_.camera.OnAway([this](bool away) {
    if (away) {
      devices_.illuminator.Blank();
      light_known_ = false;
    }
  });
}

RigState::~RigState() {
  devices_.illuminator.Blank();
  devices_.camera.OnAway({});
}

void RigState::SetLight(std::int64_t number) {
  const ScheduledPicture& picture = session_.schedule()[number];
  if (picture.channel < 0) {
    devices_.illuminator.Blank();
  } else {
    std::vector<ScanAngle> beams = session_.schedule().Beams(number, map_);
    if (picture.group >= 0) {
      const std::vector<GridIndex> lit = session_.LitPoints(picture.group);
      const auto group = session_.schedule().Group(picture.group);
      for (std::size_t k = group.size(); k-- > 0;) {
        if (std::find(lit.begin(), lit.end(), group[k]) == lit.end()) {
          beams.erase(beams.begin() + static_cast<std::ptrdiff_t>(k));
        }
      }
    }
    devices_.illuminator.Light(beams, picture.channel);
  }
  light_known_ = true;
}

// Returns the exposure that the camera applies.
double RigState::Set(std::int64_t number) {
  const ScheduledPicture& picture = session_.schedule()[number];
  if (!known_ || last_.target != picture.target || last_.pose != picture.pose) {
    devices_.illuminator.Blank();  // whoever reaches into the rig meets no beam
    known_ = false;
    light_known_ = false;
    devices_.stage.Place(picture.target, picture.pose);
  }
  if (!known_ || last_.exposure_us != picture.exposure_us) {
    applied_exposure_us_ = devices_.camera.SetExposureUs(picture.exposure_us);
  }
  if (!light_known_ || last_.channel != picture.channel ||
      last_.group != picture.group || last_.repeat != picture.repeat) {
    SetLight(number);
  }
  last_ = picture;
  known_ = true;
  return applied_exposure_us_;
}

PackedFrame RigState::Take(std::int64_t number, CaptureSummary& summary) {
  int light_failures = 0;
  for (int attempt = 1; attempt <= kAttempts;) {
    const double exposure_us = Set(number);
    // In this order: an interruption that is found by counting isn't waited for.
    const std::int64_t interruptions = devices_.illuminator.Interruptions();
    devices_.illuminator.AwaitSteady();
    const auto timeout =
        kTimeoutBeyondExposure +
        std::chrono::milliseconds(static_cast<std::int64_t>(exposure_us / 1000));
    auto packed =
        devices_.camera.CapturePacked(static_cast<std::uint64_t>(number), timeout);
    if (devices_.illuminator.Interruptions() != interruptions) {
      ++summary.light_failures;
      if (++light_failures == kMaxLightFailures) {
        throw DeviceError(fmt::format(
            "picture {}: the light failed {} times while it was exposed; see to the "
            "laser's cable, then resume the capture",
            number,
            light_failures));
      }
      continue;
    }
    if (packed) {
      packed->frame.exposure_us = exposure_us;
      packed->frame.attempts = attempt + light_failures;
      return std::move(*packed);
    }
    ++summary.frames_lost;
    ++attempt;
  }
  throw DeviceError(fmt::format(
      "picture {}: the camera lost the frame {} times; see to its cable and its host's "
      "load, then resume the capture",
      number,
      kAttempts));
}

}  // namespace nacre::acquire::internal

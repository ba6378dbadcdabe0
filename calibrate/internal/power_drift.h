#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/session_state.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace nacre::calibrate::internal {

/// What the patch in view says of the laser's power.
struct PatchSample {
  double hours = 0;
  double flux = 0;  ///< relative to the flux scale
};

std::optional<PatchSample> LookAtPatch(const acquire::SessionReader& session,
                                       const Calibration& calibration,
                                       const acquire::Frame& frame,
                                       const std::vector<float>& rates,
                                       std::int64_t number);

/// flux = patch_flux (1 + drift (t − t_reference)), least squares; sets what `state`
/// says of power. Does nothing if the samples are too few.
void FitDrift(const acquire::SessionReader& session,
              const std::vector<PatchSample>& samples,
              SessionState& state);

}  // namespace nacre::calibrate::internal

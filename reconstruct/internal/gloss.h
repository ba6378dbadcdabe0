#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/session_state.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <string>
#include <vector>

namespace nacre::reconstruct::internal {

/// What the surface itself throws back at the lit point, a channel: it looks like a
/// diffuse target of that reflectance, lit by the same spot.
struct Gloss {
  std::vector<double> reflectance;
  std::vector<double> sigma;  ///< standard uncertainty

  /// "gloss: sentence" with figures; empty if none was found.
  std::string Warning(const std::vector<std::string>& channels) const;
};

/// Around a lit point light that was inside the sample is spread, that of the surface
/// is as narrow as the laser's spot on the reference target. The mean profile around
/// the spots of some pictures is fitted by s G(r) + Σ_m w_m K_m(r), all ≥ 0: G is the
/// profile on the reference, K_m that of light from depth z_m,
///   K(r) = z / 2π (z² + r²)^(3/2),
/// blurred alike. What comes out nearer than the spot is wide is gloss by definition.
/// `camera` sees the surface of the sample; the pictures of `groups` are looked at.
Gloss MeasureGloss(const acquire::SessionReader& session,
                   const calibrate::Calibration& calibration,
                   const calibrate::CameraGeometry& camera,
                   const calibrate::SamplePlane& plane,
                   const std::vector<int>& groups);

/// Takes it away from the lit cell of slice s, and adds what is uncertain about it.
void RemoveGloss(const RdHeader& header,
                 const calibrate::Calibration& calibration,
                 const Gloss& gloss,
                 std::int64_t s,
                 RdSlice& slice);

}  // namespace nacre::reconstruct::internal

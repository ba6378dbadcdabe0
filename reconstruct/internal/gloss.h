#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/session_state.h"
#include "reconstruct/internal/cell_weights.h"
#include "reconstruct/rd_dataset.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace nacre::reconstruct::internal {

/// What the surface itself throws back at the lit point, a channel: it looks like a
/// diffuse target of that reflectance, lit by the same spot.
struct Gloss {
  std::vector<double> reflectance = {};
  std::vector<double> sigma = {};  ///< standard uncertainty
  /// The spot on the reference: ln of its density at r², ascending.
  std::vector<double> square_mm2 = {};
  std::vector<double> log_density = {};

  /// mm⁻², not normalised; 0 beyond what was looked at.
  double Density(double r2_mm2) const;

  /// In any channel, by more than three times its uncertainty.
  bool IsFound() const;
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

/// Takes it away from slices.
class GlossRemover {
 public:
  /// All must outlive this; `camera` sees the surface, `weights` are for it.
  GlossRemover(const Gloss& gloss,
               const calibrate::Calibration& calibration,
               const calibrate::SamplePlane& plane,
               const RdHeader& header,
               const CellWeights& weights);

  /// From the cells around the lit one of slice s, as they show a spot on the
  /// reference; what is uncertain about it is added to their sigma.
  void Remove(std::int64_t s, RdSlice& slice) const;

 private:
  static constexpr int kReach = 2;  // cells
  static constexpr int kSide = 2 * kReach + 1;
  // Of a spot on x_i, cell means in mm⁻² of all its light.
  std::array<double, kSide * kSide> Response(int i, int j) const;

  const Gloss& gloss_;
  const calibrate::Calibration& calibration_;
  const calibrate::SamplePlane& plane_;
  const RdHeader& header_;
  const CellWeights& weights_;
};

}  // namespace nacre::reconstruct::internal

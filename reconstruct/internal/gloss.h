#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "reconstruct/internal/group_reader.h"
#include "reconstruct/internal/group_spool.h"
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

/// From what was seen around the spots of all groups that `spool` holds (gloss_fit.h),
/// by `reader`; the reference is looked at anew. `calibration`'s camera sees the sample
/// plane. Nothing where too little was seen.
Gloss MeasureGloss(const acquire::SessionReader& session,
                   const calibrate::Calibration& calibration,
                   const GroupReader& reader,
                   const GroupSpool& spool);

/// Takes it away from slices.
class GlossRemover {
 public:
  /// All must outlive this; `reader`'s calibration is `calibration`.
  GlossRemover(const Gloss& gloss,
               const calibrate::Calibration& calibration,
               const calibrate::SamplePlane& plane,
               const RdHeader& header,
               const GroupReader& reader);

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
  const GroupReader& reader_;
};

}  // namespace nacre::reconstruct::internal

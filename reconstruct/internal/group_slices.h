#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "reconstruct/internal/cell_weights.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <vector>

namespace nacre::reconstruct::internal {

/// A cell of the lattice outside all windows of a picture: nothing but tails.
struct OutsideCell {
  int group = 0;
  int channel = 0;
  int column = 0;
  int row = 0;
  float rd = 0;  ///< the sum over the picture's spots
  float sigma = 0;
};

/// The slices that one group of spots gives, as measured: light of the group's other
/// spots is still in them.
struct GroupSlices {
  std::vector<OutsideCell> outside;  ///< some of these cells, spread evenly
  std::vector<RdSlice> slices;       ///< of Schedule::Group(group), in that order
  std::int64_t frame_count = 0;
  std::int64_t saturated_count = 0;
  std::int64_t invalid_count = 0;
};

/// Turns a session's pictures into slices, a group at a time. Const and thread-safe.
class GroupReader {
 public:
  /// Both must outlive this.
  GroupReader(const acquire::SessionReader& session,
              const calibrate::Calibration& calibration,
              const RdHeader& header,
              double spot_sigma_mm,
              int thread_count);

  GroupSlices Read(int group) const;

  std::size_t SharedBytes() const { return weights_.MemoryBytes(); }
  /// Memory that one call of Read() needs.
  std::size_t WorkingBytes() const;

 private:
  RateFrame ReadRates(int group, int channel, GroupSlices& result) const;
  /// R_d at `cell` and its variance, from light that entered with that factor.
  CellWeights::Value Measure(const RateFrame& rates,
                             std::int64_t cell,
                             double enter_factor) const;
  void SampleOutside(const RateFrame& rates,
                     int group,
                     int channel,
                     GroupSlices& result) const;

  const acquire::SessionReader& session_;
  const calibrate::Calibration& calibration_;
  const RdHeader& header_;
  CellWeights weights_;
  /// [group · channels + channel]: numbers of the pictures, one an exposure.
  std::vector<std::vector<std::int64_t>> pictures_;
  /// R_d of unit rate is exit_factor_[cell] · that of the spot and channel.
  std::vector<double> exit_factor_;
};

}  // namespace nacre::reconstruct::internal

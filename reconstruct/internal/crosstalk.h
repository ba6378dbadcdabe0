#pragma once

#include "acquire/schedule.h"
#include "reconstruct/internal/group_slices.h"
#include "reconstruct/internal/slice_spool.h"
#include "reconstruct/internal/tails.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <vector>

namespace nacre::reconstruct::internal {

/// Takes the light of the other spots of the same picture out of slices. What a window
/// holds of it is extrapolated from the tails of those spots' own slices; how tails go
/// on beyond a window is seen where a picture is outside all windows. Both are known
/// better once the windows are cleaned, so this is done twice, first with the windows'
/// inner parts alone.
class Crosstalk {
 public:
  /// `raw` holds all slices as measured; all must outlive this.
  Crosstalk(const RdHeader& header,
            const acquire::Schedule& schedule,
            const SliceSpool& raw,
            const std::vector<OutsideCell>& outside,
            int thread_count);

  /// The cleaned slice s. `share` is set to the largest share of a channel's total that
  /// was taken away.
  RdSlice Clean(std::int64_t s, double* share = nullptr) const;

 private:
  void FitTails(double outer, bool clean);
  void FitFalloff(const std::vector<OutsideCell>& outside);

  const RdHeader& header_;
  const acquire::Schedule& schedule_;
  const SliceSpool& raw_;
  int thread_count_;
  std::vector<int> group_of_;  ///< by slice
  TailMap tails_;
};

}  // namespace nacre::reconstruct::internal

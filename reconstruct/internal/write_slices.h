#pragma once

#include "calibrate/calibration.h"
#include "core/progress.h"
#include "reconstruct/internal/exposure_advice.h"
#include "reconstruct/internal/gloss.h"
#include "reconstruct/internal/separation.h"
#include "reconstruct/rd_dataset.h"
#include "reconstruct/reconstruct.h"

namespace nacre::reconstruct::internal {

/// What is done to a slice once its spots are apart.
struct Finishing {
  const RdHeader& header;
  const calibrate::Calibration& calibration;
  const GlossRemover& gloss;
  const ExposureAdvice& advice;
  double longest_us;
};

/// The second pass: slices, freed of each other's light and of what Finishing is for,
/// in the order of the file. While some are worked on, those before are written. What
/// was found goes into `summary`. Of several ranks the root calls it.
void WriteSlices(const Separation& separation,
                 const Finishing& finishing,
                 const ReconstructOptions& options,
                 RdWriter& writer,
                 ReconstructSummary& summary,
                 const ProgressFunction& progress);

/// The other ranks' part of it: batches of slices, in turn, sent to the root.
void SendSlices(const Separation& separation,
                const Finishing& finishing,
                const ReconstructOptions& options,
                const ProgressFunction& progress);

}  // namespace nacre::reconstruct::internal

#pragma once

#include "factor/internal/log_svd.h"
#include "factor/internal/method.h"

#include <vector>

namespace nacre::factor::internal {

/// The slices' coordinates in the model's bases become factor maps: a pass over all
/// slices, if the fit hasn't left them.
Material Project(Job& job, const SvdModel& model, int terms);

/// What 1, 2, …, `terms` terms give on the sample.
std::vector<TermsError> ErrorCurve(const Job& job, const SvdModel& model, int terms);

}  // namespace nacre::factor::internal

#pragma once

#include "factor/internal/log_svd.h"
#include "factor/internal/method.h"

#include <vector>

namespace nacre::factor::internal {

/// A pass over all slices: their coordinates in the model's bases become factor maps.
Material Project(Job& job, const SvdModel& model, int terms);

/// What 1, 2, …, `terms` terms give on the sample.
std::vector<TermsError> ErrorCurve(const Job& job, const SvdModel& model, int terms);

}  // namespace nacre::factor::internal

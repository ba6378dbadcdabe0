#pragma once

#include "factor/internal/method.h"
#include "factor/internal/shared_maps.h"

#include <memory>

namespace nacre::factor::internal {

/// Throws unless `made` is of these data by size and provenance, and of this method,
/// and the method is one that something can be kept of.
void CheckMade(const Material& made,
               const reconstruct::RdHeader& header,
               const FactorOptions& options);

/// Throws BadData unless `job.made` is as good on the job's sample as it says it is.
void CheckMadeError(const Job& job);

/// What of `job.made` was found the same way as the job's options would have it, seed
/// and all: the clusters; A and B; everything, its leading terms being what is asked
/// for; and whether its maps (of nmf, kernels) are what a fit begins with. With more
/// terms than there were, a fit that began so would end higher than one from nothing.
/// False where there is no such material.
bool KeepsClusters(const Job& job);
bool KeepsTransforms(const Job& job);
bool KeepsTerms(const Job& job);
bool KeepsMaps(const Job& job);

/// Fills what a job that keeps its terms needs of the data: the sample, and, where all
/// was measured and there is enough, the slices that stand for all, with all totals.
void LookAgain(Job& job);

/// The leading terms of `job.made`, an SVD.
std::unique_ptr<Method> MakeCutMethod(Job& job);

/// Puts the leading maps of `job.made`, if they are kept, in the place of those that a
/// fit begins with.
void BeginWithMade(const Job& job, SharedMaps& start);

/// What is kept, for a person.
std::string NoteOnReuse(const Job& job);

}  // namespace nacre::factor::internal

#pragma once

#include "core/progress.h"
#include "factor/factor.h"
#include "factor/internal/fit_error.h"
#include "factor/internal/log_svd.h"

#include <cstdint>
#include <vector>

namespace nacre::factor::internal {

/// The largest measurement of any channel, mm⁻².
double GlobalPeak(const SvdModel& model);

/// The errors of one slice.
struct SliceFit {
  FitError error;
  double worst_channel = 0;
  double worst_total = 0;
  std::int64_t unfit = 0;
};

/// The last pass: every slice's coordinates become factor maps, and the material that
/// results is compared with the measurements it came from.
class Projection {
 public:
  Projection(SliceSource& source, const SvdModel& model, int thread_count)
      : source_(source), model_(model), thread_count_(thread_count) {}

  /// Fills the error figures and sizes of `summary`.
  Material Run(int terms, const ProgressFunction& progress, FactorSummary& summary);

 private:
  void ProjectRow(const SliceBlock& block, std::int64_t row, Material& material);
  void Summarize(const Material& material, FactorSummary& summary) const;

  SliceSource& source_;
  const SvdModel& model_;
  int thread_count_;
  std::vector<SliceFit> fits_;  // slot i is slice i's: reduced in index order
};

/// What 1, 2, …, `terms` terms give on sampled slices; `rows` are their numbers in the
/// dataset.
std::vector<TermsError> ErrorCurve(const SvdModel& model,
                                   const reconstruct::RdDataset& sample,
                                   const std::vector<std::int64_t>& rows,
                                   int terms,
                                   int thread_count);

}  // namespace nacre::factor::internal

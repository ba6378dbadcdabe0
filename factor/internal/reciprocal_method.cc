// Reciprocal model in the logarithm, its maps shared by all channels.

#include "core/error.h"
#include "factor/internal/method.h"
#include "factor/internal/reciprocal_fit.h"
#include "factor/internal/reciprocal_rest.h"
#include "factor/internal/reciprocal_sides.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/reuse.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::factor::internal {
namespace {

class ReciprocalMethod final : public Method {
 public:
  explicit ReciprocalMethod(Job& job)
      : job_(job), data_(ReadReciprocal(job, LimitsOf(job.options), start_)) {
    BeginWithMade(job, start_);
  }

  int MostTerms() const override { return static_cast<int>(start_.rows()); }

  Material Make(int terms) override {
    const ReciprocalFit fit = FitReciprocal(data_,
                                            start_.topRows(terms),
                                            job_.options.taps,
                                            WorkersOf(job_),
                                            job_.progress);
    rounds_ += fit.rounds;
    const ReciprocalRest rest =
        job_.options.rest > 0
            ? FitRest(data_, fit, job_.options.rest, job_.options.thread_count)
            : ReciprocalRest{};
    Material m = EmptyMaterial(job_.source.header());
    m.form = Form::kReciprocal;
    m.rest = static_cast<int>(rest.u.rows());
    m.terms = terms;
    m.taps = job_.options.taps;
    m.margin = data_.margin;
    m.a = data_.scale;
    m.f.assign(fit.f.data(), fit.f.data() + fit.f.size());
    m.f.insert(m.f.end(), rest.u.data(), rest.u.data() + rest.u.size());
    for (std::size_t c = 0; c < data_.channels; ++c) {
      AddKernels(fit.h, c, m);
      AddKernels(rest.v, c, m);
    }
    AddSides(job_, data_, m);
    return m;
  }

  void Describe(FactorSummary& summary) const override {
    summary.a = data_.scale;
    summary.rounds = rounds_;
    if (job_.options.sides > 0 && data_.sides.size() == 0) {
      summary.notes.push_back(
          "the two directions of near pairs don't differ by a map's values: no side "
          "map (option sides)");
    }
    if (!data_.HoldsAll()) {
      summary.notes.push_back(fmt::format(
          "maps are fitted to {} of {} offsets, as memory allows (option memory_mb), "
          "and to 10 million pairs at most",
          data_.held.size(),
          data_.cells));
    }
  }

 private:
  // Rows of `kernels`, whose columns are cells of the first half of the window.
  void AddKernels(const Eigen::MatrixXd& kernels, std::size_t channel, Material& m) {
    const auto size = static_cast<std::size_t>(m.KernelSize());
    const auto window = static_cast<std::size_t>(m.WindowSize());
    for (Eigen::Index k = 0; k < kernels.rows(); ++k) {
      for (std::size_t cell = 0; cell < size; ++cell) {
        const std::size_t n = std::min(cell, window - 1 - cell);
        m.h.push_back(static_cast<float>(
            kernels(k, static_cast<Eigen::Index>(channel * data_.cells + n))));
      }
    }
  }

  Job& job_;
  SharedMaps start_;  // before the data, with which it is read
  ReciprocalData data_;
  int rounds_ = 0;
};

}  // namespace

ReciprocalLimits LimitsOf(const FactorOptions& options) {
  const int kernels = ReciprocalKernelCount(options.terms, options.taps);
  return {.terms = options.terms,
          .sample_pairs = std::clamp(24 * kernels, 3000, 20000),
          .memory_bytes = options.memory_mb * 1e6,
          .tail_weight = options.tail_weight,
          .sides = options.sides > 0,
          .rest = options.rest > 0};
}

std::unique_ptr<Method> MakeReciprocalMethod(Job& job) {
  if (job.options.clusters > 1) {
    throw UsageError(
        "option clusters: the reciprocal model has no clusters: its kernels join "
        "points "
        "that might lie in two");
  }
  return std::make_unique<ReciprocalMethod>(job);
}

}  // namespace nacre::factor::internal

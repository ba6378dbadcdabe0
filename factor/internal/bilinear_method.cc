// Reciprocal bilinear model, its maps shared by all channels.

#include "core/error.h"
#include "factor/internal/bilinear_fit.h"
#include "factor/internal/method.h"
#include "factor/internal/reuse.h"

#include <algorithm>

namespace nacre::factor::internal {
namespace {

Job& Checked(Job& job) {
  if (job.options.clusters > 1) {
    throw UsageError(
        "option clusters: the bilinear model has no clusters: its kernels "
        "join points that might lie in two");
  }
  return job;
}

class BilinearMethod final : public Method {
 public:
  explicit BilinearMethod(Job& job)
      : job_(Checked(job)),
        data_(ReadPairs(job, job.options.terms, job.options.tail_weight, start_)) {
    BeginWithMade(job, start_);
  }

  int MostTerms() const override { return static_cast<int>(start_.rows()); }

  Material Make(int terms) override {
    const BilinearFit fit =
        FitBilinear(data_, start_.topRows(terms), WorkersOf(job_), job_.progress);
    rounds_ += fit.rounds;
    Material m = EmptyMaterial(job_.source.header());
    m.form = Form::kBilinear;
    m.terms = terms;
    m.margin = data_.margin;
    m.f.assign(fit.f.data(), fit.f.data() + fit.f.size());
    const auto window = static_cast<std::size_t>(m.WindowSize());
    for (std::size_t c = 0; c < data_.channels; ++c) {
      for (int j = 0; j < terms; ++j) {
        for (int k = j; k < terms; ++k) {
          for (std::size_t cell = 0; cell < window; ++cell) {
            const bool is_kept = cell < data_.cells;
            const Eigen::MatrixXd& h =
                fit.h[c * data_.cells + (is_kept ? cell : window - 1 - cell)];
            m.h.push_back(
                static_cast<float>((is_kept ? h(j, k) : h(k, j)) * data_.scale));
          }
        }
      }
    }
    return m;
  }

  void Describe(FactorSummary& summary) const override { summary.rounds = rounds_; }

 private:
  Job& job_;
  SharedMaps start_;
  BilinearData data_;
  int rounds_ = 0;
};

}  // namespace

std::unique_ptr<Method> MakeBilinearMethod(Job& job) {
  return std::make_unique<BilinearMethod>(job);
}

}  // namespace nacre::factor::internal

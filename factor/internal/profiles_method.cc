// Products of Gaussian profiles, R'_d = √(P(x_i) P(x_o)): SubEdit's model [Song09],
// P being a nonnegative sum of Gaussians that are the same at all points of a channel.

#include "core/error.h"
#include "core/parallel.h"
#include "factor/internal/method.h"
#include "factor/internal/profiles_fit.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::factor::internal {
namespace {

constexpr int kRounds = 8;

Job& Checked(Job& job) {
  if (job.options.clusters > 1) {
    throw UsageError(
        "option clusters: Gaussian profiles have no clusters: each joins points that "
        "might lie in two");
  }
  return job;
}

class ProfilesMethod final : public Method {
 public:
  explicit ProfilesMethod(Job& job) : job_(Checked(job)) {}

  int MostTerms() const override {
    return job_.Peak() > 0 ? std::min(kMostGaussians, job_.options.terms) : 1;
  }

  Material Make(int terms) override {
    const reconstruct::RdHeader& header = job_.source.header();
    std::vector<ProfileBasis> bases(job_.scans.size());
    ParallelFor(std::ssize(bases), job_.options.thread_count, [&](std::int64_t c) {
      const auto channel = static_cast<std::size_t>(c);
      bases[channel] =
          ChooseGaussians(header, job_.scans[channel], terms, job_.options.tail_weight);
    });
    Material m = EmptyMaterial(header);
    m.form = Form::kProfiles;
    m.terms = terms;
    m.margin = header.Radius();
    m.f = FitProfiles(job_, bases, kRounds);
    for (const ProfileBasis& basis : bases) {
      for (const double beta : basis.beta_per_mm2) {
        m.h.push_back(static_cast<float>(std::log(beta)));
      }
    }
    return m;
  }

  void Describe(FactorSummary& summary) const override {
    if (job_.options.terms > kMostGaussians) {
      summary.notes.push_back(
          fmt::format("{} Gaussians: more can't be told apart", kMostGaussians));
    }
  }

 private:
  Job& job_;
};

}  // namespace

std::unique_ptr<Method> MakeProfilesMethod(Job& job) {
  return std::make_unique<ProfilesMethod>(job);
}

}  // namespace nacre::factor::internal

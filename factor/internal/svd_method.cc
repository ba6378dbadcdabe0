// The thesis' model and its linear special case.

#include "core/error.h"
#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/log_svd.h"
#include "factor/internal/method.h"
#include "factor/internal/projection.h"
#include "factor/internal/reuse.h"
#include "factor/internal/transform_search.h"
#include "reconstruct/clustering.h"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

namespace nacre::factor::internal {
namespace {

RowMatrix FilledRows(const reconstruct::RdDataset& sample,
                     std::size_t channel,
                     const ChannelScan& scan) {
  const auto window = static_cast<std::size_t>(sample.header.WindowSize());
  RowMatrix rows(sample.header.PointCount(), sample.header.WindowSize());
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    const std::size_t offset =
        (static_cast<std::size_t>(row) * sample.header.channels.size() + channel) *
        window;
    FillRow({&sample.rd[offset], window},
            {&sample.valid[offset], window},
            scan,
            {&rows(row, 0), window});
  }
  return rows;
}

// Of −c: values below it would leave nothing of the logarithm's argument.
constexpr double kLeastOffset = -0.9;

class SvdMethod final : public Method {
 public:
  explicit SvdMethod(Job& job) : job_(job) {
    model_.scans = job.scans;
    for (ChannelScan& scan : model_.scans) {
      if (job.options.divide_falloff) {
        scan.falloff = MeanFalloff(scan);
      }
    }
    model_.cluster.assign(static_cast<std::size_t>(job.source.header().PointCount()),
                          0);
    if (job.options.clusters > 1) {
      reconstruct::Clustering clustering = ClusterSlices(job);
      model_.cluster = std::move(clustering.labels);
      model_.cluster_count = clustering.cluster_count;
    }
    if (job.check.rows.empty() || !FitInOneReading()) {
      Fit(nullptr);
    }
    curve_ = ErrorCurve(job, model_, MostTerms());
  }

  int MostTerms() const override {
    Eigen::Index rank = 1;
    for (const RowBasis& basis : model_.bases) {
      rank = std::max(rank, basis.rank());
    }
    return std::min(job_.options.terms, static_cast<int>(rank));
  }

  Material Make(int terms) override { return Project(job_, model_, terms); }

  void Describe(FactorSummary& summary) const override {
    summary.error_curve = curve_;
    summary.search_steps = search_steps_;
    for (std::size_t c = 0; c < model_.transforms.size(); ++c) {
      const RowTransform& t = model_.transforms[c];
      if (!t.is_log) {
        continue;
      }
      summary.a.push_back(t.a);
      summary.b.push_back(t.b);
      if (t.a * t.b > 3 * model_.scans[c].peak && model_.scans[c].peak > 0) {
        summary.notes.push_back(
            fmt::format("channel {}: A·B is {:.3g} peaks: the error in R_d is least "
                        "where the logarithm is nearly linear; --log-weight trades it "
                        "for the tails",
                        c,
                        t.a * t.b / model_.scans[c].peak));
      }
    }
  }

 private:
  void Fit(RowScans* rows) {
    ChooseTransforms();
    FitSvd(job_.source,
           {.terms = job_.options.terms,
            .cluster_count = model_.cluster_count,
            .fill_rounds = job_.options.fill_rounds,
            .one_by_one = job_.options.one_by_one,
            .seed = job_.options.seed,
            .thread_count = job_.options.thread_count,
            .ranks = job_.options.ranks,
            .sample = rows != nullptr ? &job_.check : nullptr,
            .rows = rows},
           model_,
           job_.progress);
    job_.passes += model_.passes;
    model_.passes = 0;
  }

  // A and B are those of the sample, and all is scanned by the pass that fits. Returns
  // false, with all slices looked at, if these aren't what the sample promised.
  bool FitInOneReading() {
    RowScans rows(model_.scans.size(), job_.source.header().PointCount());
    Fit(&rows);
    bool regular = !model_.scores.empty();  // or the fit took another way
    for (std::size_t c = 0; c < model_.scans.size(); ++c) {
      const RowTransform& t = model_.transforms[c];
      constexpr double kAny = -std::numeric_limits<double>::infinity();
      regular =
          regular && rows.AreRegular(c, t.is_log ? kLeastOffset * t.a * t.b : kAny);
    }
    if (!regular) {
      LookAtAll(job_);
      model_.scans = job_.scans;
      model_.bases.clear();
      model_.scores.clear();
      return false;
    }
    for (std::size_t c = 0; c < model_.scans.size(); ++c) {
      rows.Store(c, job_.source.header().WindowSize(), model_.scans[c]);
    }
    job_.scans = model_.scans;
    job_.totals = std::move(rows.total);
    return true;
  }

  // A channel's transform, and how many were tried.
  struct Choice {
    RowTransform transform;
    std::int64_t tried = 0;
  };

  Choice ChooseFor(std::size_t c) const {
    const ChannelScan& scan = model_.scans[c];
    const bool is_log = job_.options.method == "log-svd";
    const double scale = std::max(scan.peak, -scan.least);
    // A channel of zeros: any A and B give ln B = 0 everywhere.
    RowTransform transform{.is_log = is_log,
                           .a = scale > 0 ? scale : 1,
                           .is_root = job_.options.method == "sqrt-svd"};
    if (!is_log || !(scale > 0)) {
      return {transform};
    }
    if (job_.made != nullptr && KeepsTransforms(job_)) {
      transform.a = job_.made->a[c];
      transform.b = job_.made->b[c];
      return {transform};
    }
    const TransformChoice choice =
        ChooseTransform(FilledRows(job_.sample.dataset, c, scan),
                        {.terms = job_.options.terms,
                         .peak = scale,
                         .least = scan.least,
                         .log_weight = job_.options.log_weight});
    return {choice.transform, choice.evaluations};
  }

  // Channels by rank.
  void ChooseTransforms() {
    const auto channels = std::ssize(model_.scans);
    std::vector<Choice> choices(model_.scans.size());
    const RankShare share = ShareOf(channels, job_.options.ranks);
    ParallelFor(
        share.end - share.begin, job_.options.thread_count, [&](std::int64_t own) {
          const auto c = static_cast<std::size_t>(share.begin + own);
          choices[c] = ChooseFor(c);
        });
    JoinShares(channels, job_.options.ranks, std::span(choices));
    model_.transforms.clear();
    search_steps_ = 0;
    for (const Choice& choice : choices) {
      model_.transforms.push_back(choice.transform);
      search_steps_ += static_cast<int>(choice.tried);
    }
  }

  Job& job_;
  SvdModel model_;
  std::vector<TermsError> curve_;
  int search_steps_ = 0;
};

}  // namespace

std::unique_ptr<Method> MakeSvdMethod(Job& job) {
  if (job.options.divide_falloff && job.options.method == "log-svd") {
    throw UsageError(
        "option divide_falloff: the logarithm's kernels can't take the mean fall-off "
        "back in; it is for the methods svd and sqrt-svd (nmf divides by it anyway)");
  }
  return std::make_unique<SvdMethod>(job);
}

}  // namespace nacre::factor::internal

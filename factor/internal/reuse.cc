// What a changed option leaves of a factorization.

#include "factor/internal/reuse.h"

#include "core/error.h"
#include "core/json.h"
#include "core/options_json.h"
#include "core/parallel.h"
#include "factor/internal/block_svd.h"
#include "factor/internal/kept_terms.h"
#include "factor/internal/measure.h"
#include "factor/internal/window_totals.h"

#include <algorithm>
#include <fmt/format.h>
#include <numeric>
#include <type_traits>
#include <vector>

namespace nacre::factor::internal {
namespace {

// A material's error on a sample may be larger than on all slices.
constexpr double kMostTimesError = 3;
constexpr double kErrorFloor = 1e-3;

Json ProvenanceOf(const Material& made) {
  return made.provenance.empty() ? Json::object()
                                 : ParseJson(made.provenance, "provenance of material");
}

// Whether these, and the seed, are as the material was made with.
bool AreSame(const Job& job, std::initializer_list<const char*> names) {
  const FactorOptions made_with = OptionsOf(*job.made);
  const Json before = OptionsToJson(made_with);
  const Json now = OptionsToJson(job.options);
  return made_with.seed == job.options.seed &&
         std::all_of(names.begin(), names.end(), [&](const char* name) {
           return before[name] == now[name];
         });
}

// Σ R_d of all slices as measured, which row_scale keeps.
std::vector<double> TotalsOf(const Material& m, int thread_count) {
  constexpr std::int64_t kRows = 256;
  const std::int64_t points = m.PointCount();
  const std::int64_t blocks = (points + kRows - 1) / kRows;
  std::vector<double> totals(m.row_scale.size());
  ParallelFor(std::ssize(m.channels) * blocks, thread_count, [&](std::int64_t task) {
    const std::int64_t first = task % blocks * kRows;
    const std::int64_t count = std::min(kRows, points - first);
    const auto at = static_cast<std::size_t>(task / blocks * points + first);
    WindowTotals(m, static_cast<int>(task / blocks), first, count, &totals[at]);
    for (std::size_t n = at; n < at + static_cast<std::size_t>(count); ++n) {
      totals[n] *= static_cast<double>(m.row_scale[n]);
    }
  });
  return totals;
}

class CutMethod final : public Method {
 public:
  explicit CutMethod(Job& job) : job_(job) {}

  int MostTerms() const override {
    return std::min(job_.options.terms, job_.made->terms);
  }

  Material Make(int terms) override {
    Material m = EmptyMaterial(job_.source.header());
    const Material& made = *job_.made;
    m.transform = made.transform;
    m.terms = made.terms;
    m.a = made.a;
    m.b = made.b;
    m.f = made.f;
    m.h = made.h;
    m.cluster = made.cluster;
    m.cluster_count = made.cluster_count;
    std::vector<int> first(static_cast<std::size_t>(terms));
    std::iota(first.begin(), first.end(), 0);
    KeepTerms(first, m);
    return m;
  }

  void Describe(FactorSummary& summary) const override {
    for (const TermsError& point : job_.made->error_curve) {
      if (point.terms <= MostTerms()) {
        summary.error_curve.push_back(point);
      }
    }
    if (job_.made->transform == Transform::kLog) {
      summary.a = job_.made->a;
      summary.b = job_.made->b;
    }
  }

 private:
  Job& job_;
};

}  // namespace

void CheckMade(const Material& made,
               const reconstruct::RdHeader& header,
               const FactorOptions& options) {
  if (options.method != made.method) {
    throw UsageError(
        fmt::format("a material by method {} is no beginning of one by {}; "
                    "factor without it, or by {}",
                    made.method,
                    options.method,
                    made.method));
  }
  if (!IsSvd(options.method) && options.method != "nmf" &&
      options.method != "bilinear" && options.method != "reciprocal") {
    throw UsageError(fmt::format(
        "nothing of a material by {} can be kept where an option changes; factor "
        "without it",
        options.method));
  }
  const auto require = [](bool same, const std::string& what) {
    if (!same) {
      throw BadData("the material to begin with is of other data: " + what);
    }
  };
  require(
      made.points_x == header.points_x && made.points_y == header.points_y &&
          made.core == header.core,
      fmt::format("{} x {} points with windows of {}, where the dataset has {} x {} "
                  "with {}",
                  made.points_x,
                  made.points_y,
                  made.core,
                  header.points_x,
                  header.points_y,
                  header.core));
  require(made.channels == header.channels, "its channels differ");
  require(made.pitch_mm == header.pitch_mm && made.eta == header.eta,
          "its pitch or index of refraction differs");
  const Json inputs = ProvenanceOf(made).value("inputs", Json::array());
  const Json of = header.provenance.empty()
                      ? Json()
                      : ParseJson(header.provenance, "provenance of the dataset");
  if (!of.is_null() && !inputs.empty() && inputs[0].contains("dataset")) {
    require(inputs[0]["dataset"] == of, "its provenance names another dataset");
  }
}

void CheckMadeError(const Job& job) {
  const auto claimed = job.made->error.find("relative_l2");
  const double found = SampleError(job, *job.made).RelativeL2();
  if (claimed != job.made->error.end() &&
      !(found <= kMostTimesError * claimed->second + kErrorFloor)) {
    throw BadData(fmt::format(
        "the material to begin with is of other data: its relative L2 error is {:.3g} "
        "on {} of the slices, where it says {:.3g}",
        found,
        job.sample.rows.size(),
        claimed->second));
  }
}

bool KeepsClusters(const Job& job) {
  return job.made != nullptr && job.made->cluster_count == job.options.clusters &&
         (job.options.clusters == 1 || AreSame(job, {"clusters"}));
}

bool KeepsTransforms(const Job& job) {
  return job.made != nullptr && job.made->transform == Transform::kLog &&
         AreSame(job, {"log_weight", "sample_rows"});
}

bool KeepsTerms(const Job& job) {
  return job.made != nullptr && IsSvd(job.options.method) &&
         job.options.terms <= OptionsOf(*job.made).terms &&
         AreSame(job,
                 {"clusters",
                  "log_weight",
                  "sample_rows",
                  "fill_rounds",
                  "one_by_one",
                  "divide_falloff"});
}

void LookAgain(Job& job) {
  const Material& made = *job.made;
  const auto peak = made.error.find("peak");
  const auto missing = made.error.find("missing_fraction");
  job.sample = TakeSample(job.source, job.options.sample_rows, job.options.seed);
  if (peak == made.error.end()) {
    job.scans = Scan(job.source, job.options.thread_count);
    ++job.passes;
    return;
  }
  job.scans.assign(job.source.header().channels.size(), {});
  job.scans[0].peak = peak->second;
  if (missing != made.error.end() && missing->second == 0 && made.cluster_count == 1 &&
      job.options.check_slices > 0 && made.PointCount() >= 2 * kSvdSampleRows) {
    job.check = TakeSample(job.source,
                           std::max(kSvdSampleRows, job.options.check_slices),
                           job.options.seed);
    job.totals = TotalsOf(made, job.options.thread_count);
  }
}

std::unique_ptr<Method> MakeCutMethod(Job& job) {
  return std::make_unique<CutMethod>(job);
}

bool KeepsMaps(const Job& job) {
  return job.made != nullptr &&
         (job.options.method == "nmf"
              ? KeepsClusters(job) && job.options.terms == job.made->terms
              : job.made->form != Form::kSum && job.options.terms <= job.made->terms);
}

void BeginWithMade(const Job& job, SharedMaps& start) {
  if (KeepsMaps(job)) {
    const Material& made = *job.made;
    start = Eigen::Map<const SharedMaps>(made.f.data(), made.MapCount(), made.MapSize())
                .topRows(job.options.terms);
  }
}

std::string NoteOnReuse(const Job& job) {
  if (KeepsTerms(job)) {
    return fmt::format(
        "of {} terms there were, those asked for are the first: nothing "
        "was fitted",
        job.made->terms);
  }
  std::string kept;
  if (KeepsMaps(job)) {
    kept = fmt::format("{} begin as those there were",
                       job.options.method == "nmf" ? "kernels" : "maps");
  } else if (KeepsTransforms(job)) {
    kept = "A and B are those there were";
  }
  if (job.options.clusters > 1 && KeepsClusters(job)) {
    kept += (kept.empty() ? "" : "; ") + std::string("clusters are those there were");
  }
  return kept.empty() ? "nothing of the material to begin with could be kept" : kept;
}

}  // namespace nacre::factor::internal

namespace nacre::factor {

FactorOptions OptionsOf(const Material& made) {
  FactorOptions options;
  const Json before = internal::ProvenanceOf(made).value("options", Json::object());
  FactorOptions::Visit(options, [&](const char* name, auto& value, Range, const char*) {
    if (before.contains(name) && name != std::string("bytes") &&
        name != std::string("error")) {
      value = before[name].get<std::remove_cvref_t<decltype(value)>>();
    }
  });
  options.method = made.method;
  options.seed = before.value("seed", options.seed);
  return options;
}

}  // namespace nacre::factor

#include "factor/factor.h"

#include "core/error.h"
#include "core/options_json.h"
#include "core/provenance.h"
#include "core/ranks.h"
#include "factor/internal/auto_method.h"
#include "factor/internal/bilinear_data.h"
#include "factor/internal/equal_rows.h"
#include "factor/internal/grey.h"
#include "factor/internal/method.h"
#include "factor/internal/reciprocal_data.h"
#include "factor/internal/reuse.h"
#include "factor/internal/terms_search.h"
#include "factor/material_file.h"
#include "reconstruct/clustering.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <memory>
#include <optional>
#include <utility>

namespace nacre::factor {
namespace {

using internal::SliceSource;

// What a method holds beside dataset and material: sums that grow with the window as
// its fourth power, or all pairs of points.
std::int64_t WorkingBytes(const reconstruct::RdHeader& header,
                          const FactorOptions& options) {
  if (options.method == "bilinear" &&
      internal::PairBytes(header) > 1e6 * options.memory_mb) {
    throw UsageError(fmt::format(
        "the bilinear model holds all pairs of points: {:.0f} MB for {} x {} points "
        "with windows of {} and {} channels, where option memory_mb allows {:.0f}; "
        "allow as much, or take --method reciprocal, which does with less",
        std::ceil(internal::PairBytes(header) / 1e6),
        header.points_x,
        header.points_y,
        header.core,
        header.channels.size(),
        options.memory_mb));
  }
  const auto channels = static_cast<double>(header.channels.size());
  const auto window = static_cast<double>(header.WindowSize());
  const double method_bytes =
      options.method == "bilinear" ? internal::PairBytes(header)
      : options.method == "reciprocal"
          ? internal::ReciprocalBytes(header, internal::LimitsOf(options))
      : options.method == "profiles"
          ? 8 * static_cast<double>(header.PointCount()) * channels * options.terms
      : options.method == "tucker"
          ? 36 * window * window + 24 * window * internal::kBlockRows
          : 8 * window * window * channels * options.clusters;
  const double bytes = method_bytes +
                       (8 + 5) * window * channels * internal::kBlockRows +
                       3 * 8 * window * options.sample_rows * channels;
  constexpr double kMost = 16e9;
  if (bytes > kMost) {
    throw Error(
        fmt::format("a window of {0} x {0} cells, {1} channels and {2} clusters would "
                    "take {3:.0f} GB of memory to factor; make the window smaller, or "
                    "use fewer clusters",
                    header.core,
                    header.channels.size(),
                    options.clusters,
                    bytes / 1e9));
  }
  return static_cast<std::int64_t>(bytes);
}

void AddNotes(const FactorOptions& options,
              std::int64_t points,
              int most_terms,
              FactorSummary& summary) {
  if (most_terms < options.terms) {
    summary.notes.push_back(
        fmt::format("{} of {} terms are kept: the data have no more to rounding",
                    most_terms,
                    options.terms));
  }
  if (summary.factored_slices < points) {
    summary.notes.push_back(
        fmt::format("{} of {} slices are distinct: each is factored once",
                    summary.factored_slices,
                    points));
  }
  if (summary.missing_fraction > 0) {
    summary.notes.push_back(
        fmt::format("{:.2f} % of the cells were not measured; the model fills them",
                    100 * summary.missing_fraction));
  }
  if (summary.measured_slices < points) {
    summary.notes.push_back(
        fmt::format("errors are those of {} of {} slices (option check-slices)",
                    summary.measured_slices,
                    points));
  }
  if (summary.unfit_slices > 0) {
    summary.notes.push_back(fmt::format(
        "{} slices have no positive total in data or model and are not scaled to it",
        summary.unfit_slices));
  }
}

void DescribeMaterial(const FactorOptions& options,
                      const reconstruct::RdHeader& header,
                      const FactorSummary& summary,
                      const Material* made,
                      Material& material) {
  material.method = options.method;
  material.error = {{"relative_l2", summary.relative_l2},
                    {"rmse_over_mean", summary.rmse_over_mean},
                    {"log_rms", summary.log_rms},
                    {"psnr_db", summary.psnr_db},
                    {"peak", summary.peak},
                    {"worst_slice", summary.worst_slice},
                    {"missing_fraction", summary.missing_fraction}};
  if (!std::isfinite(summary.psnr_db)) {
    material.error.erase("psnr_db");  // an exact fit has none
  }
  material.error_curve = summary.error_curve;
  Provenance provenance;
  provenance.command = "factor";
  provenance.options = OptionsToJson(options);
  provenance.options["seed"] = options.seed;
  if (!header.provenance.empty()) {
    provenance.inputs.push_back(
        {{"dataset", ParseJson(header.provenance, "provenance of the dataset")}});
  }
  if (made != nullptr && !made->provenance.empty()) {
    provenance.inputs.push_back(
        {{"material", ParseJson(made->provenance, "provenance of the material")}});
  }
  material.provenance = provenance.ToString();
}

using MakeMethod = std::unique_ptr<internal::Method> (*)(internal::Job&);

const std::vector<std::pair<std::string, MakeMethod>>& Methods() {
  static const std::vector<std::pair<std::string, MakeMethod>> methods{
      {"log-svd", internal::MakeSvdMethod},
      {"svd", internal::MakeSvdMethod},
      {"sqrt-svd", internal::MakeSvdMethod},
      {"tucker", internal::MakeTuckerMethod},
      {"nmf", internal::MakeNmfMethod},
      {"profiles", internal::MakeProfilesMethod},
      {"gaussian", internal::MakeProfilesMethod},
      {"bilinear", internal::MakeBilinearMethod},
      {"reciprocal", internal::MakeReciprocalMethod}};
  return methods;
}

MakeMethod FindMethod(const std::string& name) {
  for (const auto& [known, make] : Methods()) {
    if (known == name) {
      return make;
    }
  }
  throw UsageError(fmt::format("no method '{}' to factor with; there are {} and auto",
                               name,
                               fmt::join(FactorMethods(), ", ")));
}

// Where the method is one that takes equal slices once, and there are enough of them.
std::unique_ptr<internal::DistinctRows> FindDistinct(internal::Job& job) {
  if (!internal::IsSvd(job.options.method) || internal::KeepsTerms(job)) {
    return nullptr;
  }
  std::optional<internal::EqualRows> rows =
      internal::FindEqualRows(job.source, job.progress);
  if (!rows) {
    return nullptr;
  }
  ++job.passes;
  return std::make_unique<internal::DistinctRows>(job.source, std::move(*rows));
}

// A dataset whose channels are all the same is known by the first of them.
struct Data {
  SliceSource& used;  // of that channel alone, or the whole
  const reconstruct::RdHeader& header;
  bool is_grey;
  const Material* made = nullptr;  // as `used`
};

// The method, and what it needs of the data before.
std::unique_ptr<internal::Method> Begin(MakeMethod make, internal::Job& job) {
  if (internal::KeepsTerms(job)) {
    internal::LookAgain(job);
    internal::CheckMadeError(job);
    return internal::MakeCutMethod(job);
  }
  internal::Look(job);
  if (job.made != nullptr) {
    internal::CheckMadeError(job);
  }
  return job.distinct != nullptr ? internal::MakeDistinctSvdMethod(job) : make(job);
}

Factorization FactorBy(const Data& data,
                       const internal::Clusterer& clusterer,
                       const FactorOptions& asked,
                       const ProgressFunction& progress) {
  const MakeMethod make = FindMethod(asked.method);
  FactorOptions options = asked;
  if (options.terms == 0) {
    options.terms = internal::OwnTerms(options.method);
  }
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const std::int64_t working_bytes = WorkingBytes(data.used.header(), options);
  internal::Job job{data.used, options, progress, clusterer, {}, {}};
  job.made = data.made;
  const std::unique_ptr<internal::DistinctRows> distinct = FindDistinct(job);
  job.distinct = distinct.get();
  const std::unique_ptr<internal::Method> method = Begin(make, job);
  Factorization result = internal::SearchTerms(
      job, *method, [&](const FactorSummary& found, Material& material) {
        DescribeMaterial(options, data.header, found, data.made, material);
        if (data.is_grey) {
          internal::SpreadChannels(data.header.channels, material);
        }
      });
  FactorSummary& summary = result.summary;
  if (data.is_grey) {
    summary.dataset_bytes *= std::ssize(data.header.channels);
    summary.notes.push_back("all channels are the same: factored and stored once");
  }
  summary.working_bytes = working_bytes;
  summary.factored_slices =
      distinct ? distinct->header().PointCount() : data.header.PointCount();
  summary.passes = job.passes;
  if (job.made != nullptr) {
    summary.notes.push_back(internal::NoteOnReuse(job));
  }
  AddNotes(options, data.header.PointCount(), method->MostTerms(), summary);
  if (options.ranks == nullptr || options.ranks->IsRoot()) {
    summary.invariants =
        CheckInvariants(result.material, options.seed, options.thread_count);
  }
  if (const std::string note = summary.invariants.EnergyNote(); !note.empty()) {
    summary.notes.push_back(note);
  }
  summary.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

Factorization FactorSource(SliceSource& source,
                           const internal::Clusterer& clusterer,
                           const FactorOptions& options,
                           const Material* made,
                           const ProgressFunction& progress) {
  nacre::Validate(options);
  if (made != nullptr) {
    internal::CheckMade(*made, source.header(), options);
  }
  const bool is_grey = options.method != "tucker" && internal::HasEqualChannels(source);
  internal::FirstChannel first(source);
  Material made_first;
  if (made != nullptr && is_grey) {
    made_first = ChannelOf(*made, 0);
    made = &made_first;
  }
  const Data data{is_grey ? first : source, source.header(), is_grey, made};
  if (options.method != internal::kAutoMethod) {
    return FactorBy(data, clusterer, options, progress);
  }
  const bool bilinear_fits =
      internal::PairBytes(data.used.header()) <= 1e6 * options.memory_mb;
  return internal::FactorByBest(
      options, bilinear_fits, [&](const FactorOptions& candidate) {
        return FactorBy(data, clusterer, candidate, progress);
      });
}

// Of a dataset or its reader.
template <class Dataset>
Factorization FactorData(Dataset& dataset,
                         const FactorOptions& options,
                         const Material* made,
                         const ProgressFunction& progress) {
  return FactorSource(
      *internal::SourceOf(dataset),
      [&](const reconstruct::ClusterOptions& clusters, const ProgressFunction& report) {
        return reconstruct::ClusterSlices(dataset, clusters, report);
      },
      options,
      made,
      progress);
}

}  // namespace

const std::vector<std::string>& FactorMethods() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [name, make] : Methods()) {
      list.push_back(name);
    }
    return list;
  }();
  return names;
}

Factorization Factor(const reconstruct::RdDataset& dataset,
                     const FactorOptions& options,
                     const ProgressFunction& progress) {
  return FactorData(dataset, options, nullptr, progress);
}

Factorization Factor(reconstruct::RdReader& reader,
                     const FactorOptions& options,
                     const ProgressFunction& progress) {
  return FactorData(reader, options, nullptr, progress);
}

Factorization FactorAgain(const Material& made,
                          const reconstruct::RdDataset& dataset,
                          const FactorOptions& options,
                          const ProgressFunction& progress) {
  return FactorData(dataset, options, &made, progress);
}

Factorization FactorAgain(const Material& made,
                          reconstruct::RdReader& reader,
                          const FactorOptions& options,
                          const ProgressFunction& progress) {
  return FactorData(reader, options, &made, progress);
}

}  // namespace nacre::factor

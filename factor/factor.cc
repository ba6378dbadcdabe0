#include "factor/factor.h"

#include "core/error.h"
#include "core/options_json.h"
#include "core/provenance.h"
#include "factor/internal/auto_method.h"
#include "factor/internal/bilinear_data.h"
#include "factor/internal/grey.h"
#include "factor/internal/method.h"
#include "factor/internal/reciprocal_data.h"
#include "factor/internal/terms_search.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <memory>
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
          ? 16 * window * window + 24 * window * internal::kBlockRows
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
                      Material& material) {
  material.method = options.method;
  material.error = {{"relative_l2", summary.relative_l2},
                    {"rmse_over_mean", summary.rmse_over_mean},
                    {"log_rms", summary.log_rms},
                    {"psnr_db", summary.psnr_db},
                    {"peak", summary.peak},
                    {"worst_slice", summary.worst_slice}};
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

Factorization FactorSource(SliceSource& source,
                           const internal::Clusterer& clusterer,
                           const FactorOptions& asked,
                           const ProgressFunction& progress) {
  nacre::Validate(asked);
  if (asked.method == internal::kAutoMethod) {
    const bool bilinear_fits =
        internal::PairBytes(source.header()) <= 1e6 * asked.memory_mb;
    return internal::FactorByBest(
        asked, bilinear_fits, [&](const FactorOptions& candidate) {
          return FactorSource(source, clusterer, candidate, progress);
        });
  }
  const MakeMethod make = FindMethod(asked.method);
  FactorOptions options = asked;
  if (options.terms == 0) {
    options.terms = internal::OwnTerms(options.method);
  }
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const std::vector<std::string> channels = source.header().channels;
  const bool is_grey = options.method != "tucker" && internal::HasEqualChannels(source);
  internal::FirstChannel first(source);
  SliceSource& used = is_grey ? first : source;
  const std::int64_t working_bytes = WorkingBytes(used.header(), options);
  internal::Job job{used, options, progress, clusterer, {}, {}};
  internal::Look(job);
  const std::unique_ptr<internal::Method> method = make(job);
  Factorization result = internal::SearchTerms(
      job, *method, [&](const FactorSummary& found, Material& material) {
        DescribeMaterial(options, source.header(), found, material);
        if (is_grey) {
          internal::SpreadChannels(channels, material);
        }
      });
  FactorSummary& summary = result.summary;
  if (is_grey) {
    summary.dataset_bytes *= std::ssize(channels);
    summary.notes.push_back("all channels are the same: factored and stored once");
  }
  summary.working_bytes = working_bytes;
  summary.passes = job.passes;
  AddNotes(options, source.header().PointCount(), method->MostTerms(), summary);
  summary.invariants =
      CheckInvariants(result.material, options.seed, options.thread_count);
  if (const std::string note = summary.invariants.EnergyNote(); !note.empty()) {
    summary.notes.push_back(note);
  }
  summary.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
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
  return FactorSource(
      *internal::SourceOf(dataset),
      [&](const reconstruct::ClusterOptions& clusters, const ProgressFunction& report) {
        return reconstruct::ClusterSlices(dataset, clusters, report);
      },
      options,
      progress);
}

Factorization Factor(reconstruct::RdReader& reader,
                     const FactorOptions& options,
                     const ProgressFunction& progress) {
  return FactorSource(
      *internal::SourceOf(reader),
      [&](const reconstruct::ClusterOptions& clusters, const ProgressFunction& report) {
        return reconstruct::ClusterSlices(reader, clusters, report);
      },
      options,
      progress);
}

}  // namespace nacre::factor

#include "factor/factor.h"

#include "core/error.h"
#include "core/options_json.h"
#include "core/parallel.h"
#include "core/provenance.h"
#include "core/random.h"
#include "factor/internal/projection.h"
#include "factor/internal/slice_source.h"
#include "factor/internal/transform_search.h"
#include "reconstruct/clustering.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fmt/format.h>
#include <functional>

namespace nacre::factor {
namespace {

using internal::RowMatrix;
using internal::SliceBlock;
using internal::SliceSource;
using internal::SvdModel;

void CheckMethod(const std::string& method) {
  const std::vector<std::string>& known = FactorMethods();
  if (std::find(known.begin(), known.end(), method) == known.end()) {
    throw UsageError(fmt::format(
        "no method '{}' to factor with; there are {}", method, fmt::join(known, ", ")));
  }
}

// The Gram matrices are what grows with the window, as its fourth power.
std::int64_t WorkingBytes(const reconstruct::RdHeader& header,
                          const FactorOptions& options) {
  const auto channels = static_cast<double>(header.channels.size());
  const auto window = static_cast<double>(header.WindowSize());
  const double bytes = 8 * window * window * channels * options.clusters +
                       (8 + 5) * window * channels * internal::kBlockRows +
                       3 * 8 * window * options.sample_rows * channels;
  constexpr double kMost = 16e9;
  if (bytes > kMost) {
    throw Error(
        fmt::format("a window of {0} x {0} cells, {1} channels and {2} clusters would "
                    "take {3:.0f} GB "
                    "of sums to factor; make the window smaller, or use fewer clusters",
                    header.core,
                    header.channels.size(),
                    options.clusters,
                    bytes / 1e9));
  }
  return static_cast<std::int64_t>(bytes);
}

// One of every count/rows slices, at a random place in its stretch, so that the sample
// covers the whole grid.
std::vector<std::int64_t> SampleRows(std::int64_t count,
                                     int wanted,
                                     std::uint64_t seed) {
  const std::int64_t rows = std::min<std::int64_t>(count, wanted);
  RandomStream random(seed, 0x666163746F72);  // a stream of this stage's own
  std::vector<std::int64_t> sample;
  for (std::int64_t n = 0; n < rows; ++n) {
    const double place = (static_cast<double>(n) + random.Uniform()) *
                         static_cast<double>(count) / static_cast<double>(rows);
    sample.push_back(std::min(static_cast<std::int64_t>(place), count - 1));
  }
  return sample;
}

// The sampled slices, as a small dataset of its own: one row of points.
reconstruct::RdDataset ReadSample(SliceSource& source,
                                  const std::vector<std::int64_t>& sample) {
  reconstruct::RdDataset dataset;
  dataset.header = source.header();
  dataset.header.points_x = static_cast<int>(sample.size());
  dataset.header.points_y = 1;
  for (const std::int64_t slice : sample) {
    const SliceBlock block = source.Read(slice, 1);
    const std::int64_t size = source.header().SliceSize();
    dataset.rd.insert(dataset.rd.end(), block.rd, block.rd + size);
    dataset.valid.insert(dataset.valid.end(), block.valid, block.valid + size);
  }
  return dataset;
}

RowMatrix FilledRows(const reconstruct::RdDataset& sample,
                     std::size_t channel,
                     const internal::ChannelScan& scan) {
  const auto window = static_cast<std::size_t>(sample.header.WindowSize());
  RowMatrix rows(sample.header.PointCount(), sample.header.WindowSize());
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    const std::size_t offset =
        (static_cast<std::size_t>(row) * sample.header.channels.size() + channel) *
        window;
    internal::FillRow({&sample.rd[offset], window},
                      {&sample.valid[offset], window},
                      scan,
                      {&rows(row, 0), window});
  }
  return rows;
}

void ChooseTransforms(const reconstruct::RdDataset& sample,
                      const FactorOptions& options,
                      SvdModel& model,
                      FactorSummary& summary) {
  const std::size_t channels = model.scans.size();
  model.transforms.assign(channels, {});
  std::vector<int> steps(channels, 0);
  ParallelFor(
      static_cast<std::int64_t>(channels), options.thread_count, [&](std::int64_t n) {
        const auto c = static_cast<std::size_t>(n);
        const internal::ChannelScan& scan = model.scans[c];
        const bool is_log = options.method == "log-svd";
        const double scale = std::max(scan.peak, -scan.least);
        // A channel of zeros: any A and B give ln B = 0 everywhere.
        model.transforms[c] = {is_log, scale > 0 ? scale : 1, 1};
        if (!is_log || !(scale > 0)) {
          return;
        }
        const auto choice =
            internal::ChooseTransform(FilledRows(sample, c, scan),
                                      {.terms = options.terms,
                                       .peak = scale,
                                       .least = scan.least,
                                       .log_weight = options.log_weight});
        model.transforms[c] = choice.transform;
        steps[c] = choice.evaluations;
      });
  for (const int n : steps) {
    summary.search_steps += n;
  }
}

int LargestRank(const SvdModel& model) {
  Eigen::Index rank = 1;
  for (const internal::RowBasis& basis : model.bases) {
    rank = std::max(rank, basis.rank());
  }
  return static_cast<int>(rank);
}

int TermsThatFit(double bytes, int terms, const Material& material) {
  while (terms > 1) {
    const auto n = static_cast<double>(terms);
    const auto channels = static_cast<double>(material.channels.size());
    const auto points = static_cast<double>(material.PointCount());
    const double needed =
        4 * channels *
            (points * (n + 1) +
             static_cast<double>(material.WindowSize()) * material.cluster_count * n) +
        (material.cluster_count > 1 ? points : 0);
    if (needed <= bytes) {
      break;
    }
    --terms;
  }
  return terms;
}

// From the sampled curve, then verified on all slices: one term more until it holds.
Material ProjectToTarget(internal::Projection& projection,
                         const FactorOptions& options,
                         int terms,
                         SvdModel& model,
                         const ProgressFunction& progress,
                         FactorSummary& summary) {
  int chosen = terms;
  if (options.error > 0) {
    const auto good = std::find_if(
        summary.error_curve.begin(), summary.error_curve.end(), [&](const auto& point) {
          return point.relative_l2 <= options.error;
        });
    chosen = good == summary.error_curve.end() ? terms : std::min(good->terms, terms);
  }
  while (true) {
    Material material = projection.Run(chosen, progress, summary);
    ++model.passes;
    const bool reached = summary.relative_l2 <= options.error;
    if (options.error == 0 || reached || chosen == terms) {
      if (options.error > 0 && !reached) {
        summary.notes.push_back(fmt::format(
            "the error asked for, {:.4g}, is not reached with {} terms: it is "
            "{:.4g}; allow more terms",
            options.error,
            terms,
            summary.relative_l2));
      }
      return material;
    }
    ++chosen;
  }
}

void AddNotes(const SvdModel& model,
              const FactorOptions& options,
              int rank,
              FactorSummary& summary) {
  if (rank < options.terms) {
    summary.notes.push_back(
        fmt::format("{} of {} terms are kept: the data have no more to rounding",
                    rank,
                    options.terms));
  }
  for (std::size_t c = 0; c < model.transforms.size(); ++c) {
    const internal::RowTransform& t = model.transforms[c];
    if (t.is_log && t.a * t.b > 3 * model.scans[c].peak && model.scans[c].peak > 0) {
      summary.notes.push_back(
          fmt::format("channel {}: A·B is {:.3g} peaks: the error in R_d is least "
                      "where the logarithm "
                      "is nearly linear; --log-weight trades it for the tails",
                      c,
                      t.a * t.b / model.scans[c].peak));
    }
  }
  if (summary.missing_fraction > 0) {
    summary.notes.push_back(
        fmt::format("{:.2f} % of the cells were not measured; the model fills them",
                    100 * summary.missing_fraction));
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

using Clusterer = std::function<reconstruct::Clustering(
    const reconstruct::ClusterOptions&, const ProgressFunction&)>;

Factorization FactorSource(SliceSource& source,
                           const Clusterer& clusterer,
                           const FactorOptions& options,
                           const ProgressFunction& progress) {
  CheckMethod(options.method);
  nacre::Validate(options);
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const reconstruct::RdHeader& header = source.header();
  FactorSummary summary;
  summary.working_bytes = WorkingBytes(header, options);

  SvdModel model;
  model.scans = internal::Scan(source, options.thread_count);
  model.passes = 1;
  model.cluster.assign(static_cast<std::size_t>(header.PointCount()), 0);
  if (options.clusters > 1) {
    reconstruct::Clustering clustering =
        clusterer({.clusters = options.clusters,
                   .seed = options.seed,
                   .thread_count = options.thread_count},
                  progress);
    model.cluster = std::move(clustering.labels);
    model.cluster_count = clustering.cluster_count;
    ++model.passes;
  }
  const std::vector<std::int64_t> rows =
      SampleRows(header.PointCount(), options.sample_rows, options.seed);
  const reconstruct::RdDataset sample = ReadSample(source, rows);
  ChooseTransforms(sample, options, model, summary);
  internal::FitSvd(source,
                   {.terms = options.terms,
                    .cluster_count = model.cluster_count,
                    .fill_rounds = options.fill_rounds,
                    .thread_count = options.thread_count},
                   model,
                   progress);

  const int rank = std::min(options.terms, LargestRank(model));
  summary.error_curve =
      internal::ErrorCurve(model, sample, rows, rank, options.thread_count);
  int terms = rank;
  if (options.bytes > 0) {
    terms = TermsThatFit(options.bytes, rank, internal::ToMaterial(model, header, 1));
  }
  internal::Projection projection(source, model, options.thread_count);
  Material material =
      ProjectToTarget(projection, options, terms, model, progress, summary);
  AddNotes(model, options, rank, summary);
  if (options.bytes > 0 && static_cast<double>(summary.bytes) > options.bytes) {
    summary.notes.push_back(
        fmt::format("one term already takes {} bytes, more than the {:.0f} asked for; "
                    "fewer clusters "
                    "or points would take less",
                    summary.bytes,
                    options.bytes));
  }
  if (material.transform == Transform::kLog) {
    summary.a = material.a;
    summary.b = material.b;
  }
  summary.passes = model.passes;
  DescribeMaterial(options, header, summary, material);
  summary.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return {std::move(material), std::move(summary)};
}

}  // namespace

const std::vector<std::string>& FactorMethods() {
  static const std::vector<std::string> methods{"log-svd", "svd"};
  return methods;
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

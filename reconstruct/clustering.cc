#include "reconstruct/clustering.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/ranks.h"
#include "reconstruct/internal/gap_statistic.h"
#include "reconstruct/internal/kmeans.h"
#include "reconstruct/internal/slice_features.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <map>

namespace nacre::reconstruct {
namespace {

using internal::KMeansResult;
using internal::PointSet;
using internal::SliceFeatures;

constexpr std::int64_t kSampleSlices = 512;
constexpr std::int64_t kSlicesAtOnce = 256;  // read, then reduced on all threads
constexpr int kMostByGap = 16;

// Numbers labels in the order in which they appear: what a label is called doesn't
// depend on the run that found it.
Clustering Relabel(const KMeansResult& result) {
  Clustering clustering;
  std::map<int, std::uint8_t> names;
  for (const int label : result.labels) {
    const auto name =
        names.emplace(label, static_cast<std::uint8_t>(names.size())).first;
    clustering.labels.push_back(name->second);
  }
  clustering.cluster_count = static_cast<int>(names.size());
  clustering.inertia = result.inertia;
  clustering.iterations_used = result.iterations;
  return clustering;
}

// Collective: `own` of all ranks one after the other, in all of them.
void JoinRows(const Ranks* ranks, std::vector<float>& own) {
  if (ranks == nullptr) {
    return;
  }
  const auto parts = ranks->AllGather(ToBytes(std::span<const float>(own)));
  own.clear();
  for (const std::string& part : parts) {
    const auto values = FromBytes<float>(part);
    own.insert(own.end(), values.begin(), values.end());
  }
}

// Where slices come from. `view` may use `own` to hold one.
struct Source {
  std::function<internal::SliceView(std::int64_t s, RdSlice& own)> view;
};

PointSet MakePoints(const RdHeader& header,
                    const Source& source,
                    const ClusterOptions& options,
                    const ProgressFunction& progress) {
  std::vector<RdSlice> sample;
  for (const std::int64_t s :
       internal::SampleSlices(header.PointCount(), kSampleSlices, options.seed)) {
    RdSlice own;
    const internal::SliceView view = source.view(s, own);
    sample.push_back({{view.rd.begin(), view.rd.end()},
                      {view.sigma.begin(), view.sigma.end()},
                      {view.valid.begin(), view.valid.end()}});
  }
  const SliceFeatures features(header, sample, options.log_offset, options.dimensions);
  PointSet points{{}, header.PointCount(), features.dimensions()};
  const RankShare share = ShareOf(points.count, options.ranks);
  const auto width = static_cast<std::size_t>(points.dimensions);
  points.values.resize(static_cast<std::size_t>(share.end - share.begin) * width);
  std::vector<RdSlice> own(static_cast<std::size_t>(kSlicesAtOnce));
  std::vector<internal::SliceView> views;
  for (std::int64_t first = share.begin; first < share.end; first += kSlicesAtOnce) {
    Report(progress,
           {"cluster", first - share.begin, share.end - share.begin, "features"});
    const std::int64_t count = std::min(kSlicesAtOnce, share.end - first);
    views.clear();
    for (std::int64_t n = 0; n < count; ++n) {
      views.push_back(source.view(first + n, own[static_cast<std::size_t>(n)]));
    }
    const std::span<float> rows(points.Row(first - share.begin),
                                static_cast<std::size_t>(count) * width);
    ParallelForBlocks(count, 16, options.thread_count, [&](auto begin, auto end) {
      const auto at = static_cast<std::size_t>(begin);
      const auto size = static_cast<std::size_t>(end - begin);
      features.Project(std::span(views).subspan(at, size),
                       rows.subspan(at * width, size * width));
    });
  }
  JoinRows(options.ranks, points.values);
  return points;
}

Clustering Cluster(const RdHeader& header,
                   const Source& source,
                   const ClusterOptions& options,
                   const ProgressFunction& progress) {
  nacre::Validate(options);
  const PointSet points = MakePoints(header, source, options, progress);
  Report(progress, {"cluster", points.count, points.count, "k-means"});
  const int clusters =
      options.clusters > 0
          ? options.clusters
          : internal::ClusterCountByGap(points,
                                        kMostByGap,
                                        options.seed,
                                        {options.thread_count, options.ranks});
  Clustering clustering =
      Relabel(internal::BestKMeans(points,
                                   {.clusters = clusters,
                                    .max_iterations = options.iterations,
                                    .seed = options.seed},
                                   options.restarts,
                                   {options.thread_count, options.ranks}));
  clustering.dimensions_used = points.dimensions;
  return clustering;
}

// As files are checked when they are read; what isn't valid may be anything.
void CheckFinite(const RdDataset& dataset) {
  const RdHeader& header = dataset.header;
  const auto values =
      static_cast<std::size_t>(header.PointCount() * header.SliceSize());
  Expect(dataset.rd.size() == values && dataset.sigma.size() == values &&
             dataset.valid.size() == values,
         "points * channels * core * core values");
  for (std::size_t n = 0; n < values; ++n) {
    if (dataset.valid[n] == 0 ||
        (std::isfinite(dataset.rd[n]) && std::isfinite(dataset.sigma[n]))) {
      continue;
    }
    const auto at = static_cast<std::int64_t>(n);
    const std::int64_t slice = at / header.SliceSize();
    const std::int64_t cell = at % header.WindowSize();
    throw BadData(fmt::format(
        "slice ({}, {}), channel {}, window cell ({}, {}): R_d is {} +- {}; mark "
        "what wasn't measured as invalid",
        slice % header.points_x,
        slice / header.points_x,
        header.channels[static_cast<std::size_t>(at % header.SliceSize() /
                                                 header.WindowSize())],
        cell % header.core,
        cell / header.core,
        dataset.rd[n],
        dataset.sigma[n]));
  }
}

}  // namespace

Clustering ClusterSlices(const RdDataset& dataset,
                         const ClusterOptions& options,
                         const ProgressFunction& progress) {
  CheckFinite(dataset);
  const auto size = static_cast<std::size_t>(dataset.header.SliceSize());
  const auto view = [&](std::int64_t s, RdSlice&) {
    const std::size_t begin = static_cast<std::size_t>(s) * size;
    return internal::SliceView{std::span(dataset.rd).subspan(begin, size),
                               std::span(dataset.sigma).subspan(begin, size),
                               std::span(dataset.valid).subspan(begin, size)};
  };
  return Cluster(dataset.header, {view}, options, progress);
}

Clustering ClusterSlices(RdReader& reader,
                         const ClusterOptions& options,
                         const ProgressFunction& progress) {
  const int width = reader.header().points_x;
  const auto view = [&](std::int64_t s, RdSlice& own) {
    own = reader.ReadSlice(static_cast<int>(s % width), static_cast<int>(s / width));
    return internal::ViewOf(own);
  };
  return Cluster(reader.header(), {view}, options, progress);
}

}  // namespace nacre::reconstruct

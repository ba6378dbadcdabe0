#include "reconstruct/clustering.h"

#include "core/parallel.h"
#include "reconstruct/internal/gap_statistic.h"
#include "reconstruct/internal/kmeans.h"
#include "reconstruct/internal/slice_features.h"

#include <algorithm>
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

using Fetch = std::function<RdSlice(std::int64_t)>;

PointSet MakePoints(const RdHeader& header,
                    const Fetch& fetch,
                    const ClusterOptions& options,
                    const ProgressFunction& progress) {
  std::vector<RdSlice> slices;
  for (const std::int64_t s :
       internal::SampleSlices(header.PointCount(), kSampleSlices, options.seed)) {
    slices.push_back(fetch(s));
  }
  const SliceFeatures features(header, slices, options.log_offset, options.dimensions);
  PointSet points{{}, header.PointCount(), features.dimensions()};
  points.values.resize(static_cast<std::size_t>(points.count * points.dimensions));
  for (std::int64_t first = 0; first < points.count; first += kSlicesAtOnce) {
    Report(progress, {"cluster", first, points.count, "features"});
    const std::int64_t count = std::min(kSlicesAtOnce, points.count - first);
    slices.clear();
    for (std::int64_t n = 0; n < count; ++n) {
      slices.push_back(fetch(first + n));
    }
    std::vector<const RdSlice*> pointers;
    for (const RdSlice& slice : slices) {
      pointers.push_back(&slice);
    }
    ParallelForBlocks(count, 16, options.thread_count, [&](auto begin, auto end) {
      features.Project(
          std::span(pointers).subspan(static_cast<std::size_t>(begin),
                                      static_cast<std::size_t>(end - begin)),
          {points.Row(first + begin),
           static_cast<std::size_t>((end - begin) * points.dimensions)});
    });
  }
  return points;
}

Clustering Cluster(const RdHeader& header,
                   const Fetch& fetch,
                   const ClusterOptions& options,
                   const ProgressFunction& progress) {
  nacre::Validate(options);
  const PointSet points = MakePoints(header, fetch, options, progress);
  Report(progress, {"cluster", points.count, points.count, "k-means"});
  const int clusters =
      options.clusters > 0
          ? options.clusters
          : internal::ClusterCountByGap(
                points, kMostByGap, options.seed, options.thread_count);
  Clustering clustering =
      Relabel(internal::BestKMeans(points,
                                   {.clusters = clusters,
                                    .max_iterations = options.iterations,
                                    .seed = options.seed},
                                   options.restarts,
                                   options.thread_count));
  clustering.dimensions_used = points.dimensions;
  return clustering;
}

}  // namespace

Clustering ClusterSlices(const RdDataset& dataset,
                         const ClusterOptions& options,
                         const ProgressFunction& progress) {
  const auto size = dataset.header.SliceSize();
  const auto fetch = [&](std::int64_t s) {
    const auto begin = s * size;
    const auto cut = [&](const auto& values) {
      return std::remove_cvref_t<decltype(values)>(values.begin() + begin,
                                                   values.begin() + begin + size);
    };
    return RdSlice{cut(dataset.rd), cut(dataset.sigma), cut(dataset.valid)};
  };
  return Cluster(dataset.header, fetch, options, progress);
}

Clustering ClusterSlices(RdReader& reader,
                         const ClusterOptions& options,
                         const ProgressFunction& progress) {
  const int width = reader.header().points_x;
  const auto fetch = [&](std::int64_t s) {
    return reader.ReadSlice(static_cast<int>(s % width), static_cast<int>(s / width));
  };
  return Cluster(reader.header(), fetch, options, progress);
}

}  // namespace nacre::reconstruct

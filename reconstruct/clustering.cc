#include "reconstruct/clustering.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "reconstruct/internal/kmeans.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace nacre::reconstruct {
namespace {

using internal::KMeansResult;
using internal::PointSet;

constexpr std::uint64_t kProjectionStream = 0x70726F6A;  // apart from those of the runs

// Random signs, dimension after dimension: projections with them keep distances
// [Achlioptas03], so that 24 numbers stand for the thousands of a slice.
std::vector<float> Signs(std::int64_t slice_size, const ClusterOptions& options) {
  RandomStream random(options.seed, kProjectionStream);
  std::vector<float> signs(static_cast<std::size_t>(slice_size) *
                           static_cast<std::size_t>(options.dimensions));
  for (float& sign : signs) {
    sign = (random() >> 31) != 0 ? 1.0F : -1.0F;
  }
  return signs;
}

// ln(R'_d / peak + offset), channel by channel: the shape without the brightness, and
// without the logarithm of noise. Cells that aren't valid say nothing: offset alone.
void LogShape(const RdHeader& header,
              std::span<const float> rd,
              std::span<const std::uint8_t> valid,
              double offset,
              std::vector<float>& shape) {
  const auto window = static_cast<std::size_t>(header.WindowSize());
  shape.resize(rd.size());
  for (std::size_t begin = 0; begin < rd.size(); begin += window) {
    const float peak =
        *std::max_element(rd.begin() + static_cast<std::ptrdiff_t>(begin),
                          rd.begin() + static_cast<std::ptrdiff_t>(begin + window));
    const double factor = peak > 0 ? 1.0 / static_cast<double>(peak) : 0.0;
    for (std::size_t k = begin; k < begin + window; ++k) {
      const double value =
          valid[k] != 0 ? std::max(0.0, static_cast<double>(rd[k])) * factor : 0.0;
      shape[k] = static_cast<float>(std::log(value + offset));
    }
  }
}

void Project(std::span<const float> shape,
             std::span<const float> signs,
             std::span<float> features) {
  for (std::size_t d = 0; d < features.size(); ++d) {
    const float* row = &signs[d * shape.size()];
    double sum = 0;
    for (std::size_t k = 0; k < shape.size(); ++k) {
      sum += static_cast<double>(shape[k]) * static_cast<double>(row[k]);
    }
    features[d] =
        static_cast<float>(sum / std::sqrt(static_cast<double>(shape.size())));
  }
}

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

Clustering Cluster(const PointSet& points, const ClusterOptions& options) {
  std::vector<KMeansResult> runs(static_cast<std::size_t>(options.restarts));
  ParallelFor(options.restarts, options.thread_count, [&](std::int64_t run) {
    runs[static_cast<std::size_t>(run)] =
        internal::KMeans(points,
                         options.clusters,
                         options.iterations,
                         options.seed,
                         static_cast<std::uint64_t>(run));
  });
  return Relabel(
      *std::min_element(runs.begin(), runs.end(), [](const auto& a, const auto& b) {
        return a.inertia < b.inertia;
      }));
}

PointSet MakePoints(const RdHeader& header, const ClusterOptions& options) {
  PointSet points;
  points.count = header.PointCount();
  points.dimensions = options.dimensions;
  points.values.resize(static_cast<std::size_t>(points.count * points.dimensions));
  return points;
}

std::span<float> Features(PointSet& points, std::int64_t s) {
  return std::span(points.values)
      .subspan(static_cast<std::size_t>(s * points.dimensions),
               static_cast<std::size_t>(points.dimensions));
}

}  // namespace

Clustering ClusterSlices(const RdDataset& dataset,
                         const ClusterOptions& options,
                         const ProgressFunction& progress) {
  nacre::Validate(options);
  const RdHeader& header = dataset.header;
  Report(progress, {"cluster", 0, 2, "features"});
  const std::vector<float> signs = Signs(header.SliceSize(), options);
  PointSet points = MakePoints(header, options);
  const auto size = static_cast<std::size_t>(header.SliceSize());
  ParallelForBlocks(
      header.PointCount(), 16, options.thread_count, [&](auto begin, auto end) {
        std::vector<float> shape;
        for (std::int64_t s = begin; s < end; ++s) {
          const std::size_t at = static_cast<std::size_t>(s) * size;
          LogShape(header,
                   std::span(dataset.rd).subspan(at, size),
                   std::span(dataset.valid).subspan(at, size),
                   options.log_offset,
                   shape);
          Project(shape, signs, Features(points, s));
        }
      });
  Report(progress, {"cluster", 1, 2, "k-means"});
  Clustering clustering = Cluster(points, options);
  Report(progress, {"cluster", 2, 2, ""});
  return clustering;
}

Clustering ClusterSlices(RdReader& reader,
                         const ClusterOptions& options,
                         const ProgressFunction& progress) {
  nacre::Validate(options);
  const RdHeader& header = reader.header();
  const std::vector<float> signs = Signs(header.SliceSize(), options);
  PointSet points = MakePoints(header, options);
  std::vector<float> shape;
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"cluster", j, header.points_y + 1, "features"});
    for (int i = 0; i < header.points_x; ++i) {
      const RdSlice slice = reader.ReadSlice(i, j);
      LogShape(header, slice.rd, slice.valid, options.log_offset, shape);
      Project(shape, signs, Features(points, std::int64_t{j} * header.points_x + i));
    }
  }
  Report(progress, {"cluster", header.points_y, header.points_y + 1, "k-means"});
  Clustering clustering = Cluster(points, options);
  Report(progress, {"cluster", header.points_y + 1, header.points_y + 1, ""});
  return clustering;
}

}  // namespace nacre::reconstruct

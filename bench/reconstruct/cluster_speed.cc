// Clustering against plain Lloyd on the slices themselves, in one run:
//
//   cluster_speed [POINTS_A_SIDE=277] [CORE=39] [CLUSTERS=8] [RESTARTS=3]
//
// Slices are made up: a chessboard of eight materials whose decay varies by 3 % within
// each, at brightnesses that vary threefold, with noise in proportion and a floor.
// Both find their centres from as many k-means++ starts; inertia is that of the labels
// in the space of all values, ln(R'_d / peak + offset).

#include "core/parallel.h"
#include "core/random.h"
#include "core/simd_clones.h"
#include "reconstruct/clustering.h"
#include "reconstruct/internal/kmeans.h"
#include "reconstruct/internal/lanes.h"
#include "reconstruct/internal/slice_features.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace nacre::reconstruct {
namespace {

// Of all threads: the time that others leave doesn't matter.
double CpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double Seconds() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

RdDataset MakeDataset(int side, int core) {
  RdDataset dataset;
  RdHeader& header = dataset.header;
  header = {side, side, core, 0.5, 1.5, {"R"}, "{}"};
  const auto size = static_cast<std::size_t>(header.SliceSize());
  dataset.rd.resize(static_cast<std::size_t>(header.PointCount()) * size);
  dataset.sigma.resize(dataset.rd.size());
  dataset.valid.assign(dataset.rd.size(), 1);
  ParallelForBlocks(header.PointCount(), 64, 0, [&](auto begin, auto end) {
    for (std::int64_t s = begin; s < end; ++s) {
      RandomStream random(7, static_cast<std::uint64_t>(s));
      const auto kind = static_cast<int>((s % side / 9 + s / side / 9 * 3) % 8);
      const double decay = (0.5 + 0.12 * kind) * (0.97 + 0.06 * random.Uniform());
      const double lean = 0.02 * (random.Uniform() - 0.5) + 0.03 * (kind % 3);
      const double bright = 0.1 + 0.2 * random.Uniform();
      for (std::size_t k = 0; k < size; ++k) {
        const PointMm d =
            header.Offset(static_cast<int>(k) % core, static_cast<int>(k) / core);
        const double r2 = d.x * d.x + d.y * d.y + 0.09;
        const double value =
            bright * std::exp(-decay * std::sqrt(r2) + lean * d.x) / r2;
        const double sigma = 0.02 * value + 2e-5;
        const auto at = static_cast<std::size_t>(s) * size + k;
        dataset.rd[at] = static_cast<float>(
            value + sigma * 3.46 * (static_cast<double>(random.UniformFloat()) - 0.5));
        dataset.sigma[at] = static_cast<float>(sigma);
      }
    }
  });
  return dataset;
}

using internal::PointSet;

// ln(R'_d / peak + offset), all values.
PointSet AllValues(const RdDataset& dataset, double offset) {
  const auto size = static_cast<std::size_t>(dataset.header.SliceSize());
  PointSet points{std::vector<float>(dataset.rd.size()),
                  dataset.header.PointCount(),
                  static_cast<int>(size)};
  ParallelForBlocks(points.count, 64, 0, [&](auto begin, auto end) {
    for (std::int64_t s = begin; s < end; ++s) {
      const float* rd = &dataset.rd[static_cast<std::size_t>(s) * size];
      const float peak = *std::max_element(rd, rd + size);
      for (std::size_t k = 0; k < size; ++k) {
        points.Row(s)[k] =
            std::log(std::max(0.0F, rd[k]) / peak + static_cast<float>(offset));
      }
    }
  });
  return points;
}

NACRE_SIMD_CLONES float Distance2(const float* a, const float* b, int size) {
  // Two sums, so that neither waits for the other.
  internal::Lanes sum[2] = {};
  int d = 0;
  for (; d + 2 * internal::kLanes <= size; d += 2 * internal::kLanes) {
    internal::Lanes left[2];
    internal::Lanes right[2];
    std::memcpy(left, a + d, sizeof left);
    std::memcpy(right, b + d, sizeof right);
    sum[0] += (left[0] - right[0]) * (left[0] - right[0]);
    sum[1] += (left[1] - right[1]) * (left[1] - right[1]);
  }
  float total = 0;
  for (; d < size; ++d) {
    total += (a[d] - b[d]) * (a[d] - b[d]);
  }
  sum[0] += sum[1];
  for (int lane = 0; lane < internal::kLanes; ++lane) {
    total += sum[0][lane];
  }
  return total;
}

struct Plain {
  std::vector<int> labels;
  double inertia = 0;
  int iterations = 0;
};

std::vector<float> CentresOf(const PointSet& points,
                             const std::vector<int>& labels,
                             int k) {
  const auto size = static_cast<std::size_t>(points.dimensions);
  std::vector<double> sums(static_cast<std::size_t>(k) * size, 0.0);
  std::vector<double> counts(static_cast<std::size_t>(k), 0.0);
  for (std::int64_t s = 0; s < points.count; ++s) {
    const auto label = static_cast<std::size_t>(labels[static_cast<std::size_t>(s)]);
    counts[label] += 1;
    for (std::size_t d = 0; d < size; ++d) {
      sums[label * size + d] += static_cast<double>(points.Row(s)[d]);
    }
  }
  std::vector<float> centres(sums.size());
  for (std::size_t at = 0; at < sums.size(); ++at) {
    centres[at] = static_cast<float>(sums[at] / std::max(1.0, counts[at / size]));
  }
  return centres;
}

double Inertia(const PointSet& points, const std::vector<int>& labels, int k) {
  const std::vector<float> centres = CentresOf(points, labels, k);
  double sum = 0;
  for (std::int64_t s = 0; s < points.count; ++s) {
    sum += static_cast<double>(Distance2(
        points.Row(s),
        &centres[static_cast<std::size_t>(labels[static_cast<std::size_t>(s)] *
                                          points.dimensions)],
        points.dimensions));
  }
  return sum;
}

// Lloyd as written in textbooks, every distance in the space of all values (vectors,
// all threads).
Plain PlainLloyd(const PointSet& points, int k, std::uint64_t run) {
  RandomStream random(1, run);
  const auto count = static_cast<std::size_t>(points.count);
  std::vector<float> centres;
  std::vector<float> nearest(count, 3e38F);
  auto chosen =
      static_cast<std::int64_t>(random.Uniform() * static_cast<double>(points.count));
  for (int c = 0; c < k; ++c) {
    centres.insert(
        centres.end(), points.Row(chosen), points.Row(chosen) + points.dimensions);
    ParallelForBlocks(points.count, 512, 0, [&](auto begin, auto end) {
      for (std::int64_t s = begin; s < end; ++s) {
        float& least = nearest[static_cast<std::size_t>(s)];
        least = std::min(
            least, Distance2(points.Row(s), points.Row(chosen), points.dimensions));
      }
    });
    double total = 0;
    for (const float d2 : nearest) {
      total += static_cast<double>(d2);
    }
    double left = random.Uniform() * total;
    for (std::size_t s = 0; s < count && left >= 0; ++s) {
      chosen = static_cast<std::int64_t>(s);
      left -= static_cast<double>(nearest[s]);
    }
  }
  Plain plain;
  plain.labels.assign(count, -1);
  for (; plain.iterations < 100; ++plain.iterations) {
    std::vector<int> labels(count);
    ParallelForBlocks(points.count, 512, 0, [&](auto begin, auto end) {
      for (std::int64_t s = begin; s < end; ++s) {
        float best = 3e38F;
        for (int c = 0; c < k; ++c) {
          const float d2 =
              Distance2(points.Row(s),
                        &centres[static_cast<std::size_t>(c * points.dimensions)],
                        points.dimensions);
          if (d2 < best) {
            best = d2;
            labels[static_cast<std::size_t>(s)] = c;
          }
        }
      }
    });
    if (labels == plain.labels) {
      break;
    }
    plain.labels = labels;
    centres = CentresOf(points, labels, k);
  }
  plain.inertia = Inertia(points, plain.labels, k);
  return plain;
}

// The same starts in the space of features, with and without bounds.
void CompareAssignments(const RdDataset& dataset, int k, int restarts) {
  std::vector<RdSlice> slices;
  std::vector<RdSlice> sample;
  const auto size = dataset.header.SliceSize();
  for (std::int64_t s = 0; s < dataset.header.PointCount(); ++s) {
    const auto begin = s * size;
    slices.push_back(
        {{dataset.rd.begin() + begin, dataset.rd.begin() + begin + size},
         {dataset.sigma.begin() + begin, dataset.sigma.begin() + begin + size},
         {dataset.valid.begin() + begin, dataset.valid.begin() + begin + size}});
  }
  for (const auto s : internal::SampleSlices(dataset.header.PointCount(), 512, 1)) {
    sample.push_back(slices[static_cast<std::size_t>(s)]);
  }
  const internal::SliceFeatures features(dataset.header, sample, 0.003, 24);
  PointSet points{{}, dataset.header.PointCount(), features.dimensions()};
  points.values.resize(static_cast<std::size_t>(points.count * points.dimensions));
  std::vector<internal::SliceView> views;
  for (const RdSlice& slice : slices) {
    views.push_back(internal::ViewOf(slice));
  }
  features.Project(views, points.values);
  for (const int clusters : {k, 4 * k}) {
    double seconds[2];
    internal::KMeansResult results[2];
    for (int bounds = 0; bounds < 2; ++bounds) {
      const double start = Seconds();
      results[bounds] = internal::BestKMeans(
          points, {.clusters = clusters, .use_bounds = bounds == 1}, restarts, {1});
      seconds[bounds] = Seconds() - start;
    }
    std::printf(
        "features, k = %d: every distance %.3f s, with bounds %.3f s (%.0f %% of the "
        "distances), one thread; labels %s\n",
        clusters,
        seconds[0],
        seconds[1],
        100.0 * static_cast<double>(results[1].distance_count) /
            static_cast<double>(results[0].distance_count),
        results[0].labels == results[1].labels ? "equal" : "DIFFER");
  }
}

int Run(int side, int core, int k, int restarts) {
  const RdDataset dataset = MakeDataset(side, core);
  const ClusterOptions options{.clusters = k, .restarts = restarts};

  double start = Seconds();
  double cpu_start = CpuSeconds();
  double features_cpu = 0;
  const Clustering ours =
      ClusterSlices(dataset, options, [&](const Progress& progress) {
        features_cpu =
            progress.note == "k-means" ? CpuSeconds() - cpu_start : features_cpu;
        return true;
      });
  const double our_seconds = Seconds() - start;
  const double our_cpu = CpuSeconds() - cpu_start;
  start = Seconds();
  cpu_start = CpuSeconds();
  const PointSet points = AllValues(dataset, options.log_offset);
  const double log_seconds = Seconds() - start;
  const double log_cpu = CpuSeconds() - cpu_start;
  start = Seconds();
  Plain best;
  for (int run = 0; run < restarts; ++run) {
    Plain one = PlainLloyd(points, k, static_cast<std::uint64_t>(run));
    std::printf("plain Lloyd, start %d: %d iterations, inertia %.6g\n",
                run,
                one.iterations,
                one.inertia);
    best = run == 0 || one.inertia < best.inertia ? one : best;
  }
  const double plain_seconds = log_seconds + Seconds() - start;
  const double plain_cpu = CpuSeconds() - cpu_start;
  const double our_inertia =
      Inertia(points, {ours.labels.begin(), ours.labels.end()}, k);
  std::printf(
      "%d x %d slices of %d x %d, k = %d, %d starts, %d threads\n"
      "plain Lloyd: %.2f s, %.2f s of CPU (logarithms %.2f), inertia %.6g\n"
      "ClusterSlices: %.2f s, %.2f s of CPU (features %.2f), inertia %.6g (%+.3f %%), "
      "%d dimensions\n"
      "ratio: %.1f, %.1f of CPU, %.1f of CPU if logarithms cost nothing\n",
      side,
      side,
      core,
      core,
      k,
      restarts,
      ThreadCount(0),
      plain_seconds,
      plain_cpu,
      log_cpu,
      best.inertia,
      our_seconds,
      our_cpu,
      features_cpu,
      our_inertia,
      100 * (our_inertia / best.inertia - 1),
      ours.dimensions_used,
      plain_seconds / our_seconds,
      plain_cpu / our_cpu,
      (plain_cpu - log_cpu) / our_cpu);
  CompareAssignments(dataset, k, restarts);
  return 0;
}

}  // namespace
}  // namespace nacre::reconstruct

int main(int argc, char** argv) {
  const auto argument = [&](int n, int otherwise) {
    return argc > n ? std::atoi(argv[n]) : otherwise;
  };
  return nacre::reconstruct::Run(
      argument(1, 277), argument(2, 39), argument(3, 8), argument(4, 3));
}

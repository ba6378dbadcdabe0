#pragma once

#include "core/options.h"
#include "core/progress.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::reconstruct {

struct ClusterOptions {
  int clusters = 1;
  int restarts = 5;
  int iterations = 100;
  int dimensions = 24;
  double log_offset = 0.003;

  std::uint64_t seed = 1;        ///< of the sample and the first centres
  int thread_count = 0;          ///< 0: all cores; doesn't change a bit of the result
  const Ranks* ranks = nullptr;  ///< nor do these; all get the same

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("clusters",
          self.clusters,
          Range{0, 255},
          "groups of slices that look alike; 0: as many as the gap statistic finds");
    visit(
        "restarts", self.restarts, Range{1, 1000}, "k-means runs; the best one counts");
    visit("iterations", self.iterations, Range{1, 100000}, "Lloyd steps a run at most");
    visit("dimensions",
          self.dimensions,
          Range{1, 1024},
          "principal components a slice is reduced to");
    visit(
        "log_offset",
        self.log_offset,
        Range{1e-9, 1},
        "added to a slice, relative to its peak, before the logarithm: what lies below "
        "is noise");
  }
};

struct Clustering {
  int cluster_count = 0;  ///< at most what was asked for: fewer if fewer slices differ
  std::vector<std::uint8_t>
      labels;          ///< slice j · points_x + i; numbered as they appear
  double inertia = 0;  ///< Σ squared distance to the own centre, in features
  int iterations_used = 0;
  int dimensions_used = 0;
};

/// Groups the points x_i by the shape of R'_d(x_i, ·): k-means [Lloyd82] from
/// k-means++ seeds [Arthur07] on principal components of the noise-weighted
/// ln(R'_d / peak + offset), all channels (reconstruct/README.md). The same for any
/// number of threads and ranks; each rank reads its share of the slices and the sample,
/// and runs its share of the restarts. Throws BadData naming slice, channel and cell of
/// a valid value that isn't finite.
Clustering ClusterSlices(const RdDataset& dataset,
                         const ClusterOptions& options,
                         const ProgressFunction& progress = {});

/// The same, reading slice by slice: memory is points · dimensions and a sample of 512
/// slices.
Clustering ClusterSlices(RdReader& reader,
                         const ClusterOptions& options,
                         const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct

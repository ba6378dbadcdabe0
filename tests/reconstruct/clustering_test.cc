// k-means of slices: planted clusters come back, for any number of threads.

#include "reconstruct/clustering.h"

#include "core/error.h"
#include "tests/reconstruct/datasets.h"

#include <gtest/gtest.h>

namespace nacre::reconstruct {
namespace {

// A chessboard of `kinds` materials, which differ in how far light gets, with 5 % noise
// and a floor of noise at 1e-3 of the peak, at brightnesses that vary tenfold.
RdDataset Planted(int kinds, std::vector<int>& labels) {
  RdDataset dataset;
  RdHeader& header = dataset.header;
  header.points_x = 12;
  header.points_y = 10;
  header.core = 9;
  header.pitch_mm = 0.25;
  header.channels = {"R", "G"};
  RandomStream random(5, 0);
  for (int s = 0; s < 120; ++s) {
    const int kind = (s % 12 / 2 + s / 12 / 2) % kinds;
    labels.push_back(kind);
    const double brightness = 0.1 + 0.9 * random.Uniform();
    for (int c = 0; c < 2; ++c) {
      for (int n = 0; n < 81; ++n) {
        const PointMm d = header.Offset(n % 9, n / 9);
        const double value = std::exp(-std::hypot(d.x, d.y) * (2 + kind + c));
        const double noise = (random.Uniform() - 0.5) * (0.05 * value + 1e-3);
        dataset.rd.push_back(static_cast<float>(brightness * (value + noise)));
      }
    }
  }
  dataset.sigma.assign(dataset.rd.size(), 0.0F);
  dataset.valid.assign(dataset.rd.size(), 1);
  return dataset;
}

TEST(Clustering, RecoversPlantedClusters) {
  for (const int kinds : {1, 2, 3, 4}) {
    std::vector<int> planted;
    const RdDataset dataset = Planted(kinds, planted);
    const Clustering found = ClusterSlices(dataset, {.clusters = kinds});
    EXPECT_EQ(found.cluster_count, kinds);
    // Labels are numbered as they appear; so are those of a chessboard.
    std::vector<int> names(static_cast<std::size_t>(kinds), -1);
    for (std::size_t s = 0; s < planted.size(); ++s) {
      int& name = names[static_cast<std::size_t>(planted[s])];
      name = name < 0 ? found.labels[s] : name;
      EXPECT_EQ(found.labels[s], name) << kinds << " kinds, slice " << s;
    }
  }
}

TEST(Clustering, IsTheSameForAnyNumberOfThreads) {
  std::vector<int> planted;
  const RdDataset dataset = Planted(3, planted);
  const ClusterOptions options{.clusters = 7, .seed = 3, .thread_count = 1};
  const Clustering one = ClusterSlices(dataset, options);
  EXPECT_EQ(one.cluster_count, 7);
  for (const int threads : {2, 3}) {
    ClusterOptions more = options;
    more.thread_count = threads;
    const Clustering many = ClusterSlices(dataset, more);
    EXPECT_EQ(many.labels, one.labels);
    EXPECT_EQ(many.inertia, one.inertia);
  }
}

TEST(Clustering, StreamsToTheSameLabels) {
  const testing::TempFolder folder;
  std::vector<int> planted;
  const RdDataset dataset = Planted(3, planted);
  WriteDataset(folder / "x.rd.exr", dataset);
  RdReader reader(folder / "x.rd.exr");
  const ClusterOptions options{.clusters = 3};
  EXPECT_EQ(ClusterSlices(reader, options).labels,
            ClusterSlices(dataset, options).labels);
}

TEST(Clustering, FewerDifferentSlicesGiveFewerClusters) {
  RdDataset dataset;
  std::vector<int> planted;
  dataset = Planted(2, planted);
  std::fill(dataset.rd.begin(), dataset.rd.end(), 1.0F);
  const Clustering found = ClusterSlices(dataset, {.clusters = 5});
  EXPECT_EQ(found.cluster_count, 1);
  EXPECT_EQ(found.inertia, 0);
}

TEST(Clustering, OptionsOutOfRangeAreRefused) {
  std::vector<int> planted;
  EXPECT_THROW(ClusterSlices(Planted(2, planted), {.clusters = 0}), Error);
  EXPECT_THROW(ClusterSlices(Planted(2, planted), {.clusters = 256}), Error);
}

}  // namespace
}  // namespace nacre::reconstruct

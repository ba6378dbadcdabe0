// k-means of slices: planted clusters come back, for any number of threads.

#include "reconstruct/clustering.h"

#include "core/error.h"
#include "core/exr.h"
#include "reconstruct/cluster_map.h"
#include "reconstruct/internal/kmeans.h"
#include "tests/reconstruct/datasets.h"
#include "tests/support/thread_ranks.h"

#include <gtest/gtest.h>

#include <set>

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

TEST(Clustering, FindsHowManyKindsThereAre) {
  for (const int kinds : {1, 2, 3, 4}) {
    std::vector<int> planted;
    EXPECT_EQ(ClusterSlices(Planted(kinds, planted), {.clusters = 0}).cluster_count,
              kinds);
  }
}

// A channel of noise alone, as its sigma says, and a corner that wasn't measured don't
// blur what the rest tells.
TEST(Clustering, NoiseAndHolesDoNotCount) {
  std::vector<int> planted;
  RdDataset dataset = Planted(2, planted);
  RandomStream random(8, 0);
  for (std::int64_t s = 0; s < dataset.header.PointCount(); ++s) {
    for (std::int64_t k = 0; k < 81; ++k) {
      const auto at = static_cast<std::size_t>(s * 162 + 81 + k);
      dataset.rd[at] = std::exp(4 * (random.UniformFloat() - 0.5F));
      dataset.sigma[at] = 1.6F * dataset.rd[at];
      if (s % 3 == 0 && k < 20) {
        dataset.valid[at - 81] = 0;
        dataset.rd[at - 81] = 1e3F;
      }
    }
  }
  const Clustering found = ClusterSlices(dataset, {.clusters = 2});
  for (std::size_t s = 0; s < planted.size(); ++s) {
    EXPECT_EQ(found.labels[s], planted[s]) << s;
  }
}

TEST(KMeans, BoundsLeaveOutDistancesAndChangeNoLabel) {
  RandomStream random(3, 0);
  internal::PointSet points{{}, 3000, 7};
  for (int n = 0; n < 3000 * 7; ++n) {
    points.values.push_back(random.UniformFloat() + static_cast<float>(n / 7 % 5));
  }
  for (const int k : {2, 5, 40}) {
    const auto all = internal::KMeans(points, {.clusters = k, .use_bounds = false});
    const auto few = internal::KMeans(points, {.clusters = k, .use_bounds = true});
    EXPECT_EQ(all.labels, few.labels);
    EXPECT_EQ(all.inertia, few.inertia);
    EXPECT_EQ(all.iterations, few.iterations);
    EXPECT_LT(few.distance_count, all.distance_count);
  }
}

TEST(ClusterMap, HoldsTheLabelsAndAPicture) {
  const testing::TempFolder folder;
  std::vector<int> planted;
  const RdDataset dataset = Planted(3, planted);
  const Clustering found = ClusterSlices(dataset, {.clusters = 3});
  WriteClusterMap(folder / "map.exr", dataset.header, found, "{}");
  const ExrPart part = ReadExr(folder / "map.exr").at(0);
  ASSERT_EQ(part.values.size(), planted.size());
  EXPECT_EQ(part.attributes.at("nacre.kind"), "clusters");
  const PngImage picture = PictureOfClusters(dataset.header, found, 2);
  EXPECT_EQ(picture.width, 24);
  std::set<std::array<int, 3>> colours;
  for (std::size_t s = 0; s < planted.size(); ++s) {
    EXPECT_EQ(part.values[s], static_cast<float>(found.labels[s]));
    const std::size_t pixel = 3 * (s / 12 * 2 * 24 + s % 12 * 2);
    colours.insert(
        {picture.values[pixel], picture.values[pixel + 1], picture.values[pixel + 2]});
  }
  EXPECT_EQ(colours.size(), 3U);
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

TEST(Clustering, IsTheSameForAnyNumberOfRanks) {
  std::vector<int> planted;
  const RdDataset dataset = Planted(3, planted);
  for (const int clusters : {7, 0}) {  // 0: the gap statistic is shared, too
    const ClusterOptions options{.clusters = clusters, .seed = 3, .thread_count = 1};
    const Clustering alone = ClusterSlices(dataset, options);
    for (const int size : {2, 7}) {  // more than restarts
      nacre::testing::OnThreadRanks(size, [&](const Ranks& ranks) {
        ClusterOptions shared = options;
        shared.ranks = &ranks;
        const Clustering found = ClusterSlices(dataset, shared);
        EXPECT_EQ(found.labels, alone.labels);
        EXPECT_EQ(found.inertia, alone.inertia);
        EXPECT_EQ(found.iterations_used, alone.iterations_used);
      });
    }
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
  EXPECT_THROW(ClusterSlices(Planted(2, planted), {.clusters = -1}), Error);
  EXPECT_THROW(ClusterSlices(Planted(2, planted), {.clusters = 256}), Error);
}

}  // namespace
}  // namespace nacre::reconstruct

#include "cli/report/dataset_digest.h"

#include "core/random.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nacre::cli::report {
namespace {

using nacre::testing::TempFolder;
using reconstruct::RdDataset;

DatasetDigest DigestOf(const RdDataset& dataset) {
  const TempFolder folder;
  reconstruct::WriteDataset(folder / "x.rd.exr", dataset);
  reconstruct::RdReader reader(folder / "x.rd.exr");
  return Digest(reader, {});
}

// Over all pairs of points, the slow and obvious way.
double Asymmetry(const RdDataset& dataset, int channel) {
  const reconstruct::RdHeader& h = dataset.header;
  double difference2 = 0;
  double signal2 = 0;
  const auto value = [&](int i, int j, int other_i, int other_j) {
    const int u = other_i - i + h.Radius();
    const int v = other_j - j + h.Radius();
    return static_cast<double>(dataset.Window(
        j * h.points_x + i, channel)[static_cast<std::size_t>(v * h.core + u)]);
  };
  for (int a = 0; a < h.PointCount(); ++a) {
    for (int b = 0; b < a; ++b) {
      const int ai = a % h.points_x;
      const int aj = a / h.points_x;
      const int bi = b % h.points_x;
      const int bj = b / h.points_x;
      if (std::abs(ai - bi) <= h.Radius() && std::abs(aj - bj) <= h.Radius()) {
        const double there = value(ai, aj, bi, bj);
        const double back = value(bi, bj, ai, aj);
        difference2 += (there - back) * (there - back);
        signal2 += there * there + back * back;
      }
    }
  }
  return std::sqrt(difference2 / signal2);
}

TEST(DatasetDigest, AsymmetryIsThatOfAllPairs) {
  RdDataset dataset = nacre::testing::MakeChessboard(
      {.points_x = 11, .points_y = 8, .core = 5, .noise = 0.05});
  const DatasetDigest digest = DigestOf(dataset);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(
        digest.asymmetry[static_cast<std::size_t>(c)], Asymmetry(dataset, c), 1e-12);
  }
  EXPECT_GT(digest.asymmetry[0], 0.01);
}

TEST(DatasetDigest, AReciprocalDatasetHasNone) {
  // Depends on |d| and on the points together: the same there and back.
  RdDataset dataset = nacre::testing::MakeConstant(9, 7, 5, 0);
  for (int p = 0; p < 63; ++p) {
    for (int cell = 0; cell < 25; ++cell) {
      const int i = p % 9;
      const int j = p / 9;
      const int other_i = i + cell % 5 - 2;
      const int other_j = j + cell / 5 - 2;
      dataset.rd[static_cast<std::size_t>(p * 25 + cell)] =
          static_cast<float>(1 + (i + other_i) * (j + other_j) % 5);
    }
  }
  EXPECT_EQ(DigestOf(dataset).asymmetry[0], 0);
}

TEST(DatasetDigest, CountsEnergyGapsAndNoise) {
  RdDataset dataset = nacre::testing::MakeConstant(6, 4, 3, 0.5F);
  dataset.valid[0] = 0;  // the corner cell of point 0
  for (float& sigma : dataset.sigma) {
    sigma = 0.05F;
  }
  const DatasetDigest digest = DigestOf(dataset);
  const double cell = dataset.header.CellAreaMm2();
  EXPECT_NEAR(static_cast<double>(digest.albedo[0][0]), 8 * 0.5 * cell, 1e-6);
  EXPECT_NEAR(static_cast<double>(digest.albedo[0][7]), 9 * 0.5 * cell, 1e-6);
  EXPECT_NEAR(static_cast<double>(digest.valid_fraction[0]), 8.0 / 9, 1e-6);
  EXPECT_NEAR(digest.missing, 1.0 / (24 * 9), 1e-9);
  EXPECT_NEAR(digest.noise, 0.1, 1e-6);
  EXPECT_NEAR(digest.noise_asymmetry[0], 0.1, 1e-6);
  EXPECT_EQ(digest.peak[0], 0.5);
}

TEST(DatasetDigest, ProfilesAreRingMeans) {
  RdDataset dataset = nacre::testing::MakeConstant(5, 5, 5, 0);
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    const int u = static_cast<int>(n % 25) % 5 - 2;
    const int v = static_cast<int>(n % 25) / 5 - 2;
    dataset.rd[n] = static_cast<float>(std::lround(std::hypot(u, v)));
  }
  const RadialProfile profile = DigestOf(dataset).profiles[0];
  ASSERT_EQ(profile.mean.size(), 3u);
  for (std::size_t ring = 0; ring < 3; ++ring) {
    EXPECT_NEAR(profile.mean[ring], static_cast<double>(ring), 1e-6);
    EXPECT_NEAR(profile.radius_mm[ring], static_cast<double>(ring) * 0.25, 1e-12);
    EXPECT_LE(profile.low[ring], profile.high[ring]);
  }
}

TEST(DatasetDigest, OnePointHasNoPairs) {
  const DatasetDigest digest = DigestOf(nacre::testing::MakeConstant(1, 1, 3, 1));
  EXPECT_EQ(digest.pair_count, 0);
  EXPECT_EQ(digest.samples.size(), 1u);
}

}  // namespace
}  // namespace nacre::cli::report

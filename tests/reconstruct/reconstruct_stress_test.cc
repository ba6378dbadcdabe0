// Datasets that break naive arithmetic: the same list as factor_stress_test.cc.

#include "core/error.h"
#include "reconstruct/clustering.h"
#include "reconstruct/edit/edit.h"
#include "reconstruct/error_figures.h"
#include "reconstruct/rd_dataset.h"
#include "reconstruct/reciprocity.h"
#include "tests/reconstruct/datasets.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace nacre::reconstruct {
namespace {

using testing::SliceOf;
using testing::TempFolder;

RdHeader Header(int points_x, int points_y, int core) {
  RdHeader header;
  header.points_x = points_x;
  header.points_y = points_y;
  header.core = core;
  header.pitch_mm = 0.1;
  header.channels = {"R", "G"};
  return header;
}

// Two kinds of slices in stripes three points wide, 12 decades from peak to corner of a
// window of 13, times `scale`; no two slices alike.
RdDataset Stripes(double scale, int points_x = 9, int points_y = 7, int core = 13) {
  RdDataset dataset{Header(points_x, points_y, core), {}, {}, {}};
  RandomStream random(7, 0);
  const int radius = dataset.header.Radius();
  for (int p = 0; p < points_x * points_y; ++p) {
    const bool odd = p % points_x / 3 % 2 == 1;
    const double shade = 0.9 + 0.1 * random.Uniform();
    for (int c = 0; c < 2; ++c) {
      for (int v = -radius; v <= radius; ++v) {
        for (int u = -radius; u <= radius; ++u) {
          const double r = std::hypot(u, v);
          const double decades = (odd ? 12 * r / 1.42 : 6 * r) / std::max(1, radius);
          dataset.rd.push_back(
              static_cast<float>(scale * std::pow(10, -decades * shade)));
          dataset.sigma.push_back(1e-3F * dataset.rd.back());
          dataset.valid.push_back(1);
        }
      }
    }
  }
  return dataset;
}

SliceSource SourceOf(const RdDataset& dataset) {
  return {dataset.header, [&dataset](int i, int j) {
            return SliceOf(dataset, std::int64_t{j} * dataset.header.points_x + i);
          }};
}

RdDataset Edited(const RdDataset& dataset, const Edit& edit) {
  const TempFolder folder;
  WriteEdited(SourceOf(dataset), edit, "{}", folder / "e.rd.exr", {});
  return ReadDataset(folder / "e.rd.exr");
}

constexpr ClusterOptions kTwo{.clusters = 2, .thread_count = 1};

const double kScales[] = {1e-30, 1e-12, 1, 1e12, 1e30};

TEST(ReconstructStress, FilesKeepEveryFiniteFloat) {
  const TempFolder folder;
  RdDataset dataset = Stripes(1);
  const float values[] = {1e-45F,
                          1e-40F,
                          std::numeric_limits<float>::min(),
                          std::numeric_limits<float>::max(),
                          -0.0F,
                          -std::numeric_limits<float>::max(),
                          1e30F,
                          1e-30F};
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    dataset.rd[n] = values[n % std::size(values)];
  }
  WriteDataset(folder / "a.rd.exr", dataset);
  const RdDataset read = ReadDataset(folder / "a.rd.exr");
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    ASSERT_EQ(std::bit_cast<std::uint32_t>(read.rd[n]),
              std::bit_cast<std::uint32_t>(dataset.rd[n]));
  }
}

TEST(ReconstructStress, ClustersDoNotDependOnTheUnit) {
  const Clustering plain = ClusterSlices(Stripes(1), kTwo);
  ASSERT_EQ(plain.cluster_count, 2);
  for (int p = 0; p < 63; ++p) {
    EXPECT_EQ(plain.labels[static_cast<std::size_t>(p)], p % 9 / 3 % 2);
  }
  for (const double scale : kScales) {
    const Clustering scaled = ClusterSlices(Stripes(scale), kTwo);
    EXPECT_EQ(scaled.labels, plain.labels) << scale;
    EXPECT_NEAR(scaled.inertia / plain.inertia, 1, 1e-3) << scale;
  }
}

TEST(ReconstructStress, WhatLooksAlikeIsOneCluster) {
  for (const float value : {0.0F, 0.25F, 1e-42F, 1e-30F, 1e30F, -1.0F}) {
    RdDataset dataset = Stripes(1);
    std::fill(dataset.rd.begin(), dataset.rd.end(), value);
    EXPECT_EQ(ClusterSlices(dataset, kTwo).cluster_count, 1) << value;
  }
  RdDataset copies = Stripes(1);  // rank 1
  const auto size = static_cast<std::size_t>(copies.header.SliceSize());
  for (std::size_t n = size; n < copies.rd.size(); ++n) {
    copies.rd[n] = copies.rd[n % size];
    copies.sigma[n] = copies.sigma[n % size];
  }
  EXPECT_EQ(ClusterSlices(copies, kTwo).cluster_count, 1);
}

TEST(ReconstructStress, SmallestGridsAndHalvesThatWereNotMeasured) {
  EXPECT_EQ(ClusterSlices(Stripes(1, 1, 1, 1), kTwo).cluster_count, 1);
  EXPECT_EQ(ClusterSlices(Stripes(1, 1, 1), kTwo).cluster_count, 1);
  EXPECT_EQ(ClusterSlices(Stripes(1, 9, 1), kTwo).cluster_count, 2);
  RdDataset half = Stripes(1);
  const auto size = static_cast<std::size_t>(half.header.SliceSize());
  for (std::size_t n = 0; n < half.rd.size(); ++n) {
    if (n % size % 13 < 6) {  // left halves of windows, with what must not be looked at
      half.rd[n] = 1e20F;
      half.valid[n] = 0;
    }
  }
  EXPECT_EQ(ClusterSlices(half, kTwo).labels, ClusterSlices(Stripes(1), kTwo).labels);
  std::fill(half.valid.begin(), half.valid.end(), std::uint8_t{0});
  EXPECT_EQ(ClusterSlices(half, kTwo).cluster_count, 1);
}

TEST(ReconstructStress, NotANumberIsRefusedAndNamedUnlessMasked) {
  const Clustering plain = ClusterSlices(Stripes(1), kTwo);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
    for (const bool in_sigma : {false, true}) {
      RdDataset dataset = Stripes(1);
      // Slice (3, 1), channel G, cell (2, 4).
      const std::size_t at = (1 * 9 + 3) * 338 + 169 + 4 * 13 + 2;
      (in_sigma ? dataset.sigma : dataset.rd)[at] = bad;
      EXPECT_THAT(nacre::testing::ErrorMessage([&] { ClusterSlices(dataset, kTwo); }),
                  ::testing::HasSubstr("slice (3, 1), channel G, window cell (2, 4)"));
      dataset.valid[at] = 0;
      EXPECT_EQ(ClusterSlices(dataset, kTwo).labels, plain.labels) << bad;
    }
  }
}

// Sums against long double, over 12 decades.
TEST(ReconstructStress, ErrorFiguresAreThoseOfLongDouble) {
  for (const double scale : kScales) {
    const RdDataset a = Stripes(scale);
    RdDataset b = Stripes(scale);
    RandomStream random(3, 1);
    long double error2 = 0;
    long double signal2 = 0;
    long double log2 = 0;
    long double logs = 0;
    const auto floor =
        1e-5L * static_cast<long double>(*std::max_element(a.rd.begin(), a.rd.end()));
    for (std::size_t n = 0; n < b.rd.size(); ++n) {
      b.rd[n] *= 1 + 0.1F * (random.UniformFloat() - 0.5F);
      const auto x = static_cast<long double>(a.rd[n]);
      const auto y = static_cast<long double>(b.rd[n]);
      error2 += (y - x) * (y - x);
      signal2 += x * x;
      if (x > floor) {
        const long double ratio = std::log(std::max(y, floor) / x);
        log2 += ratio * ratio;
        logs += 1;
      }
    }
    const ErrorFigures f = CompareSlices(SourceOf(a), SourceOf(b));
    EXPECT_NEAR(
        f.relative_l2 / static_cast<double>(std::sqrt(error2 / signal2)), 1, 1e-12)
        << scale;
    EXPECT_NEAR(f.log_rms / static_cast<double>(std::sqrt(log2 / logs)), 1, 1e-12)
        << scale;
  }
}

TEST(ReconstructStress, NothingAgainstNothingIsNoError) {
  RdDataset zeros = Stripes(0);
  const ErrorFigures f = CompareSlices(SourceOf(zeros), SourceOf(zeros));
  EXPECT_EQ(f.relative_l2, 0);
  EXPECT_EQ(f.rmse, 0);
  EXPECT_EQ(f.log_count, 0);
  EXPECT_FALSE(f.ToString("mm^-2").empty());
}

// R(a, b) = R(b, a) to the bit, and the same relative to the unit, over 12 decades.
TEST(ReconstructStress, EditsAreReciprocalAtAnyScale) {
  const RdDataset plain = Edited(Stripes(1), {});
  for (const double scale : {1e-30, 1e-12, 1.0}) {
    const RdDataset edited = Edited(Stripes(scale), {});
    for (std::size_t n = 0; n < plain.rd.size(); ++n) {
      ASSERT_NEAR(
          static_cast<double>(edited.rd[n]) / scale / static_cast<double>(plain.rd[n]),
          1,
          scale < 1e-20 ? 1e-2 : 1e-6)  // 1e-42 has two digits
          << scale << " " << n;
    }
    const TempFolder folder;
    WriteDataset(folder / "e.rd.exr", edited);
    RdReader reader(folder / "e.rd.exr");
    const ReciprocityFigures figures = MeasureReciprocity(reader);
    EXPECT_GT(figures.pair_count, 100) << scale;
    EXPECT_LT(figures.difference, scale < 1e-20 ? 1e-2 : 1e-6) << scale;
  }
}

TEST(ReconstructStress, EditsNeverGiveMoreThanCameIn) {
  for (const double scale : {1.0, 1e12, 1e30}) {
    const RdDataset edited = Edited(Stripes(scale), {});
    for (std::int64_t s = 0; s < edited.header.PointCount(); ++s) {
      for (int c = 0; c < 2; ++c) {
        double total = 0;
        for (const float value : edited.Window(s, c)) {
          ASSERT_TRUE(value >= 0 && std::isfinite(value)) << scale;
          total += static_cast<double>(value);
        }
        ASSERT_LE(total * edited.header.CellAreaMm2(), 1 + 1e-6) << scale;
      }
    }
  }
}

TEST(ReconstructStress, RangesAreStretchedAlikeAtAnyScale) {
  const auto points = static_cast<std::size_t>(63);
  const Edit wider{.range = std::vector<float>(points, 1.5F)};
  const RdDataset plain = Edited(Stripes(1e-3), wider);
  const RdDataset small = Edited(Stripes(1e-24), wider);
  for (std::size_t n = 0; n < plain.rd.size(); ++n) {
    ASSERT_NEAR(
        static_cast<double>(small.rd[n]) * 1e21 / static_cast<double>(plain.rd[n]),
        1,
        1e-4)
        << n;
  }
  for (const float value : Edited(Stripes(0), wider).rd) {
    ASSERT_EQ(value, 0);
  }
}

}  // namespace
}  // namespace nacre::reconstruct

// Equal slices are factored once, and come out as if each had been factored.

#include "factor/internal/equal_rows.h"

#include "factor/factor.h"
#include "tests/factor/expect.h"
#include "tests/factor/synthetic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace nacre::factor {
namespace {

using nacre::testing::ExpectNear;
using nacre::testing::MakeChessboard;
using reconstruct::RdDataset;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr std::size_t kKinds = 9;

// 12 × 10 slices of nine kinds, in turn but for the first three, some cells missing.
RdDataset MakeRepeating(bool with_missing) {
  RdDataset dataset =
      MakeChessboard({.points_x = 12, .points_y = 10, .core = 7, .noise = 1e-3});
  if (with_missing) {
    for (std::size_t n = 0; n < dataset.valid.size(); n += 31) {
      dataset.valid[n] = 0;
    }
  }
  const auto size = static_cast<std::size_t>(dataset.header.SliceSize());
  for (std::size_t slice = kKinds; slice < 120; ++slice) {
    const std::size_t from = (slice < 90 ? slice % kKinds : slice % 3) * size;
    std::copy_n(&dataset.rd[from], size, &dataset.rd[slice * size]);
    std::copy_n(&dataset.valid[from], size, &dataset.valid[slice * size]);
  }
  return dataset;
}

// The same values, but no two slices whose bytes are: any flag but 0 is valid.
RdDataset MakeDistinct(RdDataset dataset) {
  const auto size = static_cast<std::size_t>(dataset.header.SliceSize());
  for (std::size_t slice = 0; slice < 120; ++slice) {
    std::uint8_t* valid = &dataset.valid[slice * size];
    std::uint8_t* flag = std::find(valid + slice, valid + size, std::uint8_t{1});
    *flag = static_cast<std::uint8_t>(2 + slice);
  }
  return dataset;
}

class EqualRows : public ::testing::TestWithParam<const char*> {};

TEST_P(EqualRows, AreFactoredOnceAndGiveTheSame) {
  for (const bool with_missing : {false, true}) {
    for (const int clusters : {1, 3}) {
      const RdDataset dataset = MakeRepeating(with_missing);
      const FactorOptions options{
          .method = GetParam(), .terms = 3, .clusters = clusters, .bits = 32};
      const auto once = Factor(dataset, options);
      const auto each = Factor(MakeDistinct(dataset), options);
      EXPECT_EQ(once.summary.factored_slices, 9);
      EXPECT_THAT(once.summary.notes, Contains(HasSubstr("9 of 120 slices")));
      EXPECT_EQ(each.summary.factored_slices, 120);
      ExpectNear(once.material.f, each.material.f, 2e-5);
      ExpectNear(once.material.h, each.material.h, 2e-5);
      ExpectNear(once.material.row_scale, each.material.row_scale, 2e-6);
      ExpectNear(once.material.albedo, each.material.albedo, 2e-6);
      EXPECT_EQ(once.material.cluster, each.material.cluster);
      EXPECT_NEAR(once.summary.relative_l2 / each.summary.relative_l2, 1, 1e-5);
      EXPECT_NEAR(once.summary.log_rms / each.summary.log_rms, 1, 1e-5);
      EXPECT_NEAR(once.summary.missing_fraction, each.summary.missing_fraction, 1e-12);
      EXPECT_EQ(once.summary.measured_slices, 120);
      EXPECT_EQ(once.summary.worst_slice_i, each.summary.worst_slice_i);
      EXPECT_EQ(once.summary.worst_slice_j, each.summary.worst_slice_j);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Svds,
                         EqualRows,
                         ::testing::Values("svd", "log-svd"),
                         [](const auto& method) {
                           std::string name = method.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(FindEqualRows, TellsValuesAndMasksApart) {
  RdDataset dataset = MakeRepeating(false);
  const auto source = internal::SourceOf(dataset);
  const auto rows = internal::FindEqualRows(*source, {});
  ASSERT_TRUE(rows.has_value());
  EXPECT_EQ(rows->first, (std::vector<std::int64_t>{0, 1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(rows->count,
            (std::vector<std::int64_t>{20, 20, 20, 10, 10, 10, 10, 10, 10}));
  EXPECT_EQ(rows->set[95], 95 % 3);
  const auto size = static_cast<std::size_t>(dataset.header.SliceSize());
  dataset.valid[95 * size] = 0;
  dataset.rd[97 * size + 5] += 1e-6F;
  const auto changed = internal::FindEqualRows(*internal::SourceOf(dataset), {});
  ASSERT_TRUE(changed.has_value());
  EXPECT_EQ(changed->set[95], 9);
  EXPECT_EQ(changed->set[97], 10);
}

TEST(FindEqualRows, LeavesDataWithFewEqualSlicesAlone) {
  const RdDataset dataset = MakeDistinct(MakeRepeating(false));
  EXPECT_FALSE(internal::FindEqualRows(*internal::SourceOf(dataset), {}).has_value());
}

// One row of a matrix, and every slice exact.
TEST(EqualRows, AHomogeneousDatasetIsOneRow) {
  RdDataset dataset =
      MakeChessboard({.points_x = 100, .points_y = 90, .core = 9, .channels = 1});
  for (std::size_t n = 81; n < dataset.rd.size(); ++n) {
    dataset.rd[n] = dataset.rd[n - 81];
  }
  const auto [m, summary] = Factor(dataset, {.method = "log-svd", .terms = 4});
  EXPECT_EQ(summary.factored_slices, 1);
  EXPECT_EQ(summary.passes, 1);
  EXPECT_EQ(m.terms, 1);
  EXPECT_LT(summary.relative_l2, 1e-6);
}

}  // namespace
}  // namespace nacre::factor

// Error figures against values worked out by hand.

#include "reconstruct/error_figures.h"

#include "core/error.h"
#include "core/json.h"
#include "tests/reconstruct/datasets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::reconstruct {
namespace {

using ::testing::HasSubstr;

SliceSource Source(const RdDataset& dataset) {
  return {dataset.header, [&dataset](int i, int j) {
            return testing::SliceOf(dataset, j * dataset.header.points_x + i);
          }};
}

RdDataset TwoSlices(const std::vector<float>& values) {
  RdDataset dataset;
  dataset.header.points_x = 2;
  dataset.header.points_y = 1;
  dataset.header.core = 1;
  dataset.header.pitch_mm = 0.5;
  dataset.header.channels = {"R", "G"};
  dataset.rd = values;
  dataset.sigma.assign(4, 0.0F);
  dataset.valid.assign(4, 1);
  return dataset;
}

TEST(ErrorFigures, AreWhatTheirDefinitionsSay) {
  const RdDataset a = TwoSlices({3, 1, 2, 4});
  const RdDataset b = TwoSlices({3, 1, 4, 3});
  const ErrorFigures figures = CompareSlices(Source(a), Source(b));
  EXPECT_EQ(figures.value_count, 4);
  EXPECT_DOUBLE_EQ(figures.relative_l2, std::sqrt(5.0 / 30.0));
  EXPECT_DOUBLE_EQ(figures.rmse, std::sqrt(5.0 / 4.0));
  EXPECT_DOUBLE_EQ(figures.rmse_over_mean, std::sqrt(5.0 / 4.0) / 2.5);
  EXPECT_EQ(figures.peak, 4);
  EXPECT_NEAR(figures.psnr_db, 20 * std::log10(4 / std::sqrt(1.25)), 1e-12);
  EXPECT_NEAR(figures.log_rms,
              std::sqrt((std::pow(std::log(2.0), 2) + std::pow(std::log(0.75), 2)) / 4),
              1e-12);
  EXPECT_DOUBLE_EQ(figures.worst_slice, 1.0);
  EXPECT_EQ(figures.worst_slice_i, 1);
  EXPECT_DOUBLE_EQ(figures.worst_total, 1.0);
  EXPECT_DOUBLE_EQ(figures.energy_ratio, 1.1);
  EXPECT_DOUBLE_EQ(figures.max_albedo_a, 4 * 0.25);
}

TEST(ErrorFigures, EqualDatasetsHaveNone) {
  const RdDataset a = testing::RandomDataset(testing::RandomHeader(3), 3);
  const ErrorFigures figures = CompareSlices(Source(a), Source(a));
  EXPECT_EQ(figures.relative_l2, 0);
  EXPECT_EQ(figures.log_rms, 0);
  EXPECT_EQ(figures.worst_total, 0);
  EXPECT_EQ(figures.ToJson()["psnr_db"], "inf");
}

TEST(ErrorFigures, WhatIsNotValidInBothIsLeftOut) {
  const RdDataset a = TwoSlices({3, 1, 2, 4});
  RdDataset b = TwoSlices({3, 1, 4, 3});
  b.valid = {1, 1, 0, 0};
  const ErrorFigures figures = CompareSlices(Source(a), Source(b));
  EXPECT_EQ(figures.value_count, 2);
  EXPECT_EQ(figures.invalid_count, 2);
  EXPECT_EQ(figures.relative_l2, 0);
}

TEST(ErrorFigures, DifferentGridsAreNotCompared) {
  const RdDataset a = TwoSlices({3, 1, 2, 4});
  RdDataset b = a;
  b.header.pitch_mm = 0.25;
  try {
    CompareSlices(Source(a), Source(b));
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("pitch 0.25 mm"));
    EXPECT_EQ(e.code(), ExitCode::kBadData);
  }
}

}  // namespace
}  // namespace nacre::reconstruct

// Rounding of factor maps and kernels, and the files that hold them.

#include "core/error.h"
#include "core/exr.h"
#include "factor/factor.h"
#include "factor/internal/kept_terms.h"
#include "factor/internal/material_codes.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace nacre::factor {
namespace {

using nacre::testing::MakeChessboard;
using nacre::testing::TempFolder;
using reconstruct::RdDataset;
using ::testing::HasSubstr;

RdDataset Noisy() {
  return MakeChessboard({.points_x = 32, .points_y = 28, .core = 11, .noise = 1e-3});
}

TEST(Quantize, AddsNoMoreThanAPercentAndSavesMoreThanHalf) {
  for (const char* method : {"log-svd", "svd", "bilinear"}) {
    const FactorSummary exact =
        Factor(Noisy(), {.method = method, .terms = 6, .bits = 32}).summary;
    const FactorSummary rounded =
        Factor(Noisy(), {.method = method, .terms = 6}).summary;
    EXPECT_EQ(exact.bits, 32);
    EXPECT_EQ(exact.added_l2, 0);
    EXPECT_LE(rounded.bits, 16) << method;
    EXPECT_LE(rounded.added_l2, 0.01);
    EXPECT_LE(rounded.added_log, 0.01);
    // Said of a sample, true of all.
    EXPECT_LT(rounded.relative_l2, 1.02 * exact.relative_l2) << method;
    EXPECT_LT(rounded.log_rms, 1.02 * exact.log_rms) << method;
    EXPECT_LT(rounded.bytes, exact.bytes / 2) << method;
  }
}

TEST(Quantize, FewerBitsAreASmallerFileAndMoreError) {
  FactorSummary before = Factor(Noisy(), {.terms = 6, .bits = 16}).summary;
  for (const double bits : {12.0, 8.0, 5.0}) {
    const FactorSummary now = Factor(Noisy(), {.terms = 6, .bits = bits}).summary;
    EXPECT_EQ(now.bits, bits);
    EXPECT_LT(now.bytes, before.bytes);
    EXPECT_GE(now.added_l2, before.added_l2 - 1e-4);
    before = now;
  }
  EXPECT_GT(before.added_l2, 0.1);
}

// What changes no pixel isn't stored.
TEST(Quantize, TermsThatRoundingLeavesNothingOfAreLeftOut) {
  const auto [m, summary] = Factor(MakeChessboard({.points_x = 16, .points_y = 14}),
                                   {.method = "svd", .terms = 10, .bits = 4});
  EXPECT_LT(summary.terms, 10);
  EXPECT_EQ(summary.terms, m.terms);
  EXPECT_THAT(summary.notes, ::testing::Contains(HasSubstr("rounding leaves nothing")));
  Validate(m, "after rounding");

  Material idle = nacre::testing::MakeMaterial(3);
  const auto map = static_cast<std::size_t>(idle.MapSize());
  for (std::size_t c = 0; c < 3; ++c) {
    std::fill_n(&idle.f[2 * c * map], map, 0.0F);  // the first of two terms
  }
  Material kept = idle;
  EXPECT_EQ(internal::DropIdleTerms(kept), 0);  // the first stays
  for (std::size_t c = 0; c < 3; ++c) {
    std::swap_ranges(
        &kept.f[2 * c * map], &kept.f[(2 * c + 1) * map], &kept.f[(2 * c + 1) * map]);
  }
  idle = kept;
  EXPECT_EQ(internal::DropIdleTerms(kept), 1);
  EXPECT_EQ(kept.terms, 1);
  Validate(kept, "without the idle term");
  for (int c = 0; c < 3; ++c) {
    std::vector<float> with(9);
    std::vector<float> without(9);
    idle.EvaluateWindow(c, 2, 1, with.data());
    kept.EvaluateWindow(c, 2, 1, without.data());
    EXPECT_EQ(with, without);
  }
}

TEST(Quantize, NeverMakesTheFileLarger) {
  // Every row of points repeats the first: so do the floats of the maps.
  RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 24, .core = 11, .channels = 1});
  const auto row = static_cast<std::size_t>(20 * dataset.header.SliceSize());
  for (std::size_t n = row; n < dataset.rd.size(); ++n) {
    dataset.rd[n] = dataset.rd[n % row];
  }
  for (const char* method : {"svd", "bilinear"}) {
    const FactorSummary exact =
        Factor(dataset, {.method = method, .terms = 8, .bits = 32}).summary;
    const FactorSummary automatic =
        Factor(dataset, {.method = method, .terms = 8}).summary;
    EXPECT_LE(automatic.bytes, exact.bytes) << method;
  }
}

TEST(Quantize, OtherBitsAreRefused) {
  for (const double bits : {2.0, 20.0}) {
    try {
      Factor(Noisy(), {.terms = 2, .bits = bits});
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kUsage);
      EXPECT_THAT(e.what(), HasSubstr("option bits"));
    }
  }
}

TEST(Quantize, TheSummaryKnowsTheSizeOfTheFile) {
  const TempFolder folder;
  for (const double bits : {0.0, 32.0}) {
    const auto [m, summary] = Factor(Noisy(), {.terms = 3, .bits = bits});
    WriteMaterial(folder / "m.nacre.exr", m);
    EXPECT_EQ(
        summary.bytes,
        static_cast<std::int64_t>(std::filesystem::file_size(folder / "m.nacre.exr")));
  }
}

TEST(Quantize, RoundTripIsExact) {
  const TempFolder folder;
  const Material m = Factor(Noisy(), {.terms = 4, .clusters = 2}).material;
  ASSERT_FALSE(m.steps.empty());
  WriteMaterial(folder / "m.nacre.exr", m);
  const Material read = ReadMaterial(folder / "m.nacre.exr");
  EXPECT_EQ(read.f, m.f);
  EXPECT_EQ(read.h, m.h);
  EXPECT_EQ(read.row_scale, m.row_scale);
  EXPECT_EQ(read.albedo, m.albedo);
  EXPECT_EQ(read.cluster, m.cluster);
  EXPECT_EQ(read.steps, m.steps);
}

TEST(Quantize, BadStepsInAFileAreNamed) {
  const TempFolder folder;
  WriteMaterial(folder / "m.nacre.exr", Factor(Noisy(), {.terms = 2}).material);
  const std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  const auto complaint = [&](const char* steps) -> std::string {
    std::vector<ExrPart> changed = parts;
    changed[0].attributes["nacre.steps"] = steps;
    WriteExr(folder / "bad.exr", changed);
    try {
      ReadMaterial(folder / "bad.exr");
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      return e.what();
    }
    return "none";
  };
  EXPECT_THAT(complaint("{}"), HasSubstr("nacre.steps has no 'f'"));
  EXPECT_THAT(complaint(R"({"f":["1"],"f_least":"0","h":[],"h_least":"0",
                            "row_scale":"1"})"),
              HasSubstr("steps of f: 1 values where 6 are expected"));
  EXPECT_THAT(complaint(R"({"f":["1","1","1","1","1","0"],"f_least":"0",
                            "h":["1","1","1"],"h_least":"0","row_scale":"1"})"),
              HasSubstr("step of f: 0"));
  EXPECT_THAT(complaint(R"({"f":["1","1","1","1","1","1"],"f_least":"0",
                            "h":["1","1","1"],"h_least":"x","row_scale":"1"})"),
              HasSubstr("'x', not a number"));
}

TEST(Quantize, ValuesBesideTheirStepsAreNotWritten) {
  const TempFolder folder;
  Material m = Factor(Noisy(), {.terms = 2}).material;
  m.f[3] += 0.4F * m.steps.f[0];
  EXPECT_THROW(WriteMaterial(folder / "m.nacre.exr", m), std::exception);
}

// IEEE 754 binary16: 11 significant bits, spacing 2^-24 below 2^-14.
TEST(Quantize, HalvesAreThoseOfTheStandard) {
  EXPECT_EQ(internal::RoundToHalf(1.0F), 1.0F);
  EXPECT_EQ(internal::RoundToHalf(1.0004F), 1.0F);
  EXPECT_EQ(internal::RoundToHalf(1.0006F), 1.0F + 0x1p-10F);
  EXPECT_EQ(internal::RoundToHalf(65504.0F), 65504.0F);
  EXPECT_EQ(internal::RoundToHalf(0x1.8p-24F), 0x1p-23F);
  EXPECT_EQ(internal::RoundToHalf(0.0F), 0.0F);
}

}  // namespace
}  // namespace nacre::factor

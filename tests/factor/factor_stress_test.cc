// Data that break naive factorizations.

#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "tests/factor/synthetic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre::factor {
namespace {

using nacre::testing::MakeChessboard;
using nacre::testing::MakeConstant;
using reconstruct::RdDataset;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

class FactorStress : public ::testing::TestWithParam<const char*> {
 protected:
  static FactorOptions Options(int terms) {
    return {.method = GetParam(), .terms = terms, .window_rank = 0};
  }
  // As many terms, or the few that take the reciprocal model as long.
  static int TermsOf(int terms) {
    return GetParam() == std::string("reciprocal") ? 2 : terms;
  }
  static bool IsReciprocal() {
    return GetParam() == std::string("bilinear") ||
           GetParam() == std::string("reciprocal") || IsProfiles();
  }
  static bool IsProfiles() { return GetParam() == std::string("profiles"); }
  // Channels are polynomials of their mean, or slices products of profiles.
  static bool IsRestricted() {
    return IsReciprocal() || GetParam() == std::string("tucker");
  }
  // Gaussians aren't found one after the other: as many as are asked for stay.
  static void ExpectOneTerm(const Material& m) {
    if (!IsProfiles()) {
      EXPECT_EQ(m.terms, 1);
    }
  }
  // Sums keep each slice's total to a step of row_scale; what is reciprocal can't.
  static void ExpectTotals(const FactorSummary& summary) {
    EXPECT_LT(summary.worst_total,
              IsReciprocal() ? 0.3 : 0.1 * summary.relative_l2 + 1e-6);
  }
};

TEST_P(FactorStress, ZerosStayZeros) {
  const auto [m, summary] = Factor(MakeConstant(4, 3, 5, 0), Options(10));
  ExpectOneTerm(m);
  EXPECT_EQ(summary.relative_l2, 0);
  for (int p = 0; p < 12; ++p) {
    EXPECT_EQ(m.Evaluate(0, p % 4, p / 4, 2, 2), 0);
  }
}

TEST_P(FactorStress, AConstantIsOneTerm) {
  const auto [m, summary] = Factor(MakeConstant(6, 5, 7, 0.25F), Options(10));
  ExpectOneTerm(m);
  EXPECT_LT(summary.relative_l2, IsProfiles() ? 0.05 : 1e-6);
  if (!IsProfiles()) {
    EXPECT_THAT(summary.notes, Contains(HasSubstr("1 of 10 terms")));
  }
}

TEST_P(FactorStress, OneSliceIsExact) {
  const RdDataset dataset = MakeChessboard({.points_x = 1, .points_y = 1});
  const auto [m, summary] = Factor(dataset, Options(10));
  ExpectOneTerm(m);
  EXPECT_LT(
      summary.relative_l2,
      IsRestricted() ? ((IsProfiles() ? 0.3 : 0.01)) : 1e-6);  // it isn't symmetric
}

TEST_P(FactorStress, OneCellWindows) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 9, .points_y = 7, .core = 1, .channels = 1});
  const auto [m, summary] = Factor(dataset, Options(10));
  ExpectOneTerm(m);
  EXPECT_LT(summary.relative_l2, IsReciprocal() ? 1e-5 : 1e-6);
}

TEST_P(FactorStress, OneRowOfPoints) {
  const RdDataset dataset = MakeChessboard({.points_x = 40, .points_y = 1, .core = 7});
  EXPECT_LT(Factor(dataset, Options(TermsOf(12))).summary.relative_l2,
            IsRestricted() ? 0.1 : 0.03);
}

TEST_P(FactorStress, DuplicatedSlicesHaveTheRankOfOne) {
  const RdDataset one = MakeChessboard({.points_x = 1, .points_y = 1, .core = 9});
  RdDataset many = MakeChessboard({.points_x = 10, .points_y = 6, .core = 9});
  for (std::size_t n = 0; n < many.rd.size(); ++n) {
    many.rd[n] = one.rd[n % one.rd.size()];
  }
  const auto [m, summary] = Factor(many, Options(4));
  ExpectOneTerm(m);
  EXPECT_LT(
      summary.relative_l2,
      IsRestricted() ? ((IsProfiles() ? 0.3 : 0.01)) : 1e-6);  // it isn't symmetric
}

TEST_P(FactorStress, TheUnitDoesNotMatter) {
  const double plain =
      Factor(MakeChessboard({.points_x = 16, .points_y = 16}), Options(TermsOf(6)))
          .summary.relative_l2;
  for (const double scale : {1e-30, 1e30}) {
    const RdDataset dataset =
        MakeChessboard({.points_x = 16, .points_y = 16, .scale = scale});
    const auto [m, summary] = Factor(dataset, Options(TermsOf(6)));
    EXPECT_NEAR(summary.relative_l2 / plain, 1, 0.02) << scale;
    ExpectTotals(summary);
  }
}

TEST_P(FactorStress, NegativeNoiseIsNotClipped) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 20, .points_y = 20, .noise = 0.02});
  const auto [m, summary] = Factor(dataset, Options(5));
  ExpectTotals(summary);
  // Five terms can't follow noise, but must not amplify it: the noise itself is this
  // large.
  const RdDataset clean = MakeChessboard({.points_x = 20, .points_y = 20});
  double noise = 0;
  double signal = 0;
  for (std::size_t n = 0; n < clean.rd.size(); ++n) {
    noise += std::pow(static_cast<double>(clean.rd[n] - dataset.rd[n]), 2);
    signal += std::pow(static_cast<double>(dataset.rd[n]), 2);
  }
  // The root is steep where noise crosses zero.
  const double bound = GetParam() == std::string("sqrt-svd") ? 1.15 : 1.1;
  EXPECT_LT(summary.relative_l2, bound * std::sqrt(noise / signal));
}

TEST_P(FactorStress, HalvesOfNothingAndOfNegatives) {
  RdDataset dataset = MakeChessboard({.points_x = 8, .points_y = 8, .core = 5});
  for (std::size_t n = 0; n < dataset.rd.size() / 2; ++n) {
    dataset.rd[n] = -0.001F;
  }
  const auto [m, summary] = Factor(dataset, Options(5));
  EXPECT_GT(summary.unfit_slices, 0);
  for (const float value : m.row_scale) {
    ASSERT_TRUE(std::isfinite(value));
  }
  EXPECT_THAT(summary.notes, Contains(HasSubstr("not scaled")));
}

TEST_P(FactorStress, NotANumberIsRefusedAndNamed) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity()}) {
    RdDataset dataset = MakeChessboard({.points_x = 6, .points_y = 4, .core = 5});
    // Slice (3, 1), channel G, cell (2, 4).
    dataset.rd[(1 * 6 + 3) * 75 + 25 + 4 * 5 + 2] = bad;
    try {
      Factor(dataset, Options(3));
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      EXPECT_THAT(e.what(),
                  AllOf(HasSubstr("slice (3, 1)"),
                        HasSubstr("channel G"),
                        HasSubstr("cell (2, 4)")));
    }
  }
}

TEST_P(FactorStress, ExactRankIsFoundExactly) {
  if (IsRestricted()) {
    GTEST_SKIP() << "these rows are of no such form";
  }
  // A positive matrix of rank 3: the linear model must keep three terms and no more.
  RdDataset dataset = MakeConstant(12, 10, 7, 0);
  RandomStream random(3, 0);
  std::vector<double> f(360);
  std::vector<double> h(147);
  for (double& value : f) {
    value = random.Uniform();
  }
  for (double& value : h) {
    value = random.Uniform();
  }
  for (std::size_t p = 0; p < 120; ++p) {
    for (std::size_t d = 0; d < 49; ++d) {
      double sum = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        sum += f[p * 3 + j] * h[j * 49 + d];
      }
      dataset.rd[p * 49 + d] = static_cast<float>(sum);
    }
  }
  const auto [m, summary] = Factor(dataset, Options(3));
  EXPECT_LT(summary.relative_l2, GetParam() == std::string("svd") ? 1e-6 : 0.02);
}

INSTANTIATE_TEST_SUITE_P(Methods,
                         FactorStress,
                         ::testing::Values("log-svd",
                                           "svd",
                                           "sqrt-svd",
                                           "tucker",
                                           "nmf",
                                           "profiles",
                                           "bilinear",
                                           "reciprocal"),
                         [](const auto& method) {
                           std::string name = method.param;
                           std::erase(name, '-');
                           return name;
                         });

// What has to hold of every material is looked at when it is made.
TEST_P(FactorStress, InvariantsAreMeasured) {
  const auto [m, summary] = Factor(
      MakeChessboard({.points_x = 12, .points_y = 12, .core = 7}), Options(TermsOf(6)));
  const Invariants& found = summary.invariants;
  EXPECT_EQ(found.slices, 64);
  EXPECT_GE(found.least, 0);
  EXPECT_GT(found.largest, 0);
  EXPECT_GT(found.pairs, 1000);
  if (IsReciprocal()) {
    EXPECT_EQ(found.asymmetry, 0) << "the same bits both ways";
  }
  EXPECT_LT(found.asymmetry, 0.5);
  const float largest = *std::max_element(m.albedo.begin(), m.albedo.end());
  EXPECT_EQ(found.largest_total, static_cast<double>(largest));
}

TEST(FactorInvariants, MoreLightOutThanInIsSaid) {
  // 25 cells of 10 mm⁻² are far above 1, whatever the pitch of the synthetic grid.
  RdDataset bright = MakeConstant(4, 3, 5, 10);
  bright.header.pitch_mm = 1;
  const auto summary = Factor(bright, {.terms = 1}).summary;
  EXPECT_EQ(summary.invariants.above_one, 12);
  EXPECT_NEAR(summary.invariants.largest_total, 250, 0.5);
  EXPECT_THAT(summary.notes, Contains(HasSubstr("12 totals of slices are above 1")));
  RdDataset white = MakeConstant(4, 3, 5, 0.04F);
  white.header.pitch_mm = 1;
  EXPECT_EQ(Factor(white, {.terms = 1}).summary.invariants.above_one, 0);
}

// Columns of 1 and 3 by turns, whatever x_o: pairs an odd way apart differ by their
// mean, the others not at all.
TEST(FactorInvariants, AsymmetryIsThatOfThePairs) {
  RdDataset dataset = MakeConstant(16, 16, 5, 1);
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    dataset.rd[n] = n / 25 % 2 == 0 ? 1.0F : 3.0F;
  }
  const Material m = Factor(dataset, {.method = "svd", .terms = 2}).material;
  const Invariants found = CheckInvariants(m);
  // Of the 24 ways 10 are odd.
  EXPECT_NEAR(found.asymmetry, std::sqrt(10.0 / 24), 0.03);
  EXPECT_EQ(CheckInvariants(m, 1, 3).asymmetry, found.asymmetry);
  EXPECT_NE(CheckInvariants(m, 2).asymmetry, found.asymmetry);
}

TEST(FactorInvariants, WhatIsNotFiniteIsRefusedAndNamed) {
  Material m = Factor(MakeConstant(2, 1, 3, 1), {.method = "svd", .bits = 32}).material;
  m.row_scale.assign(m.row_scale.size(), std::numeric_limits<float>::max());
  m.h.assign(m.h.size(), std::numeric_limits<float>::max());
  m.f.assign(m.f.size(), 1);
  try {
    CheckInvariants(m);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(
        e.what(),
        AllOf(HasSubstr("R_d = inf at slice (0, 0)"), HasSubstr("cell (0, 0)")));
  }
}

TEST(FactorStress, SizesThatDoNotFitTheHeaderAreRefused) {
  RdDataset dataset = MakeConstant(3, 3, 3, 1);
  dataset.valid.pop_back();
  EXPECT_THROW(Factor(dataset, {}), Error);
}

TEST(FactorStress, WindowsTooLargeForMemorySaySo) {
  RdDataset dataset = MakeConstant(1, 1, 255, 1);
  try {
    Factor(dataset, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("255 x 255"));
  }
}

}  // namespace
}  // namespace nacre::factor

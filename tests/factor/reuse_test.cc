// Factoring again with an option changed: what is kept, and that it is as good.

#include "core/error.h"
#include "factor/factor.h"
#include "tests/factor/expect.h"
#include "tests/factor/synthetic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace nacre::factor {
namespace {

using nacre::testing::ExpectNear;
using nacre::testing::MakeChessboard;
using reconstruct::RdDataset;
using ::testing::Contains;
using ::testing::HasSubstr;

class Reuse : public ::testing::TestWithParam<const char*> {};

// From nothing, the same numbers come of the same A and B (all terms, then fewer for a
// size), with four readings instead of one.
TEST_P(Reuse, LeadingTermsAreThoseFromNothing) {
  RdDataset dataset =
      MakeChessboard({.points_x = 24, .points_y = 20, .core = 9, .noise = 1e-4});
  dataset.valid[1000] = 0;
  for (const int clusters : {1, 2}) {
    FactorOptions options{
        .method = GetParam(), .terms = 7, .clusters = clusters, .bits = 32};
    const auto made = Factor(dataset, options);
    options.terms = 4;
    const auto again = FactorAgain(made.material, dataset, options);
    options.terms = 7;
    options.bytes = static_cast<double>(again.summary.bytes) + 2000;
    const auto nothing = Factor(dataset, options);
    ASSERT_EQ(again.material.terms, 4);
    ASSERT_EQ(nothing.material.terms, 4);
    ExpectNear(again.material.f, nothing.material.f, 1e-6);
    ExpectNear(again.material.h, nothing.material.h, 1e-7);
    ExpectNear(again.material.row_scale, nothing.material.row_scale, 1e-6);
    EXPECT_EQ(again.material.cluster, nothing.material.cluster);
    EXPECT_NEAR(again.summary.relative_l2, nothing.summary.relative_l2, 1e-7);
    EXPECT_NEAR(again.summary.log_rms, nothing.summary.log_rms, 1e-6);
    EXPECT_EQ(again.summary.passes, 1);
    EXPECT_GT(made.summary.passes, 3);
    EXPECT_THAT(again.summary.notes, Contains(HasSubstr("nothing was fitted")));
  }
}

INSTANTIATE_TEST_SUITE_P(Svds,
                         Reuse,
                         ::testing::Values("svd", "sqrt-svd", "log-svd"),
                         [](const auto& method) {
                           std::string name = method.param;
                           std::erase(name, '-');
                           return name;
                         });

// The linear model has no A and B to choose.
TEST(Reuse, FewerTermsOfSvdAreThoseAskedForFromNothing) {
  const RdDataset dataset = MakeChessboard({.points_x = 24, .points_y = 20, .core = 9});
  FactorOptions options{.method = "svd", .terms = 6, .bits = 32};
  const auto made = Factor(dataset, options);
  options.terms = 3;
  const auto again = FactorAgain(made.material, dataset, options);
  const auto nothing = Factor(dataset, options);
  ExpectNear(again.material.f, nothing.material.f, 1e-5);
  ExpectNear(again.material.h, nothing.material.h, 1e-5);
}

// Where errors are those of a sample, nothing else is read.
TEST(Reuse, LargeDataAreNotReadAgain) {
  const RdDataset dataset = MakeChessboard(
      {.points_x = 96, .points_y = 90, .core = 9, .channels = 1, .noise = 1e-4});
  FactorOptions options{.method = "log-svd", .terms = 4};
  const auto made = Factor(dataset, options);
  options.terms = 3;
  const auto again = FactorAgain(made.material, dataset, options);
  const auto nothing = Factor(dataset, options);
  EXPECT_EQ(nothing.summary.passes, 1);
  EXPECT_EQ(again.summary.passes, 0);
  EXPECT_EQ(again.summary.measured_slices, 4096);
  EXPECT_EQ(again.summary.search_steps, 0);
  EXPECT_NEAR(again.summary.relative_l2 / nothing.summary.relative_l2, 1, 0.02);
  ExpectNear(again.material.albedo, nothing.material.albedo, 1e-3);
}

// Clusters of before need no reading; kernels only go on where there are as many.
TEST(Reuse, NmfKeepsClustersAndKernels) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 14, .points_y = 12, .core = 5, .channels = 1});
  FactorOptions options{.method = "nmf", .terms = 3, .clusters = 2};
  const auto made = Factor(dataset, options);
  options.bits = 32;
  const auto again = FactorAgain(made.material, dataset, options);
  EXPECT_EQ(again.material.cluster, made.material.cluster);
  EXPECT_EQ(again.summary.passes, made.summary.passes - 1);
  EXPECT_LE(again.summary.relative_l2, made.summary.relative_l2);
  EXPECT_THAT(again.summary.notes, Contains(HasSubstr("kernels begin")));
  options.terms = 4;
  const auto more = FactorAgain(made.material, dataset, options);
  const auto nothing = Factor(dataset, options);
  EXPECT_EQ(more.material.f, nothing.material.f);
  EXPECT_EQ(more.summary.passes, nothing.summary.passes - 1);
}

TEST(Reuse, SharedMapsBeginAsTheyWere) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 16, .points_y = 16, .core = 7, .noise = 1e-4});
  for (const std::string method : {"reciprocal", "bilinear"}) {
    FactorOptions options{.method = method, .terms = 3};
    const auto made = Factor(dataset, options);
    for (const int terms : {3, 2}) {
      options.terms = terms;
      options.bits = 32;
      const auto again = FactorAgain(made.material, dataset, options).summary;
      const auto nothing = Factor(dataset, options).summary;
      EXPECT_EQ(again.passes, nothing.passes - (method == "reciprocal" ? 1 : 0));
      EXPECT_LT(again.rounds, nothing.rounds) << method << terms;
      EXPECT_LT(again.relative_l2, 1.02 * nothing.relative_l2) << method << terms;
      EXPECT_THAT(again.notes, Contains(HasSubstr("maps begin")));
    }
  }
}

TEST(Reuse, GreyDataAndTheirMaterialsToo) {
  RdDataset dataset = MakeChessboard({.points_x = 12, .points_y = 10, .core = 7});
  const auto window = static_cast<std::size_t>(dataset.header.WindowSize());
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    dataset.rd[n] = dataset.rd[n / (3 * window) * 3 * window + n % window];
  }
  FactorOptions options{.method = "svd", .terms = 4};
  const auto made = Factor(dataset, options);
  options.terms = 2;
  const auto again = FactorAgain(made.material, dataset, options);
  EXPECT_TRUE(again.material.is_grey);
  EXPECT_EQ(again.material.terms, 2);
}

// A change that the fit depends on is a fit of its own.
TEST(Reuse, OptionsThatMatterAreFollowed) {
  const RdDataset dataset = MakeChessboard(
      {.points_x = 16, .points_y = 12, .core = 7, .channels = 1, .noise = 1e-4});
  const auto made =
      Factor(dataset, {.method = "log-svd", .terms = 3, .log_weight = 0.5});
  FactorOptions options = OptionsOf(made.material);
  EXPECT_EQ(options.method, "log-svd");
  EXPECT_EQ(options.terms, 3);
  EXPECT_EQ(options.log_weight, 0.5);
  options.terms = 5;
  const auto more = FactorAgain(made.material, dataset, options).summary;
  EXPECT_EQ(more.terms, 5);
  EXPECT_EQ(more.search_steps, 0);
  EXPECT_THAT(more.notes, Contains("A and B are those there were"));
  options.log_weight = 0;
  const auto other = FactorAgain(made.material, dataset, options).summary;
  EXPECT_GT(other.search_steps, 0);
  EXPECT_THAT(other.notes, Contains(HasSubstr("nothing of the material")));
  EXPECT_EQ(other.relative_l2, Factor(dataset, options).summary.relative_l2);
}

void ExpectRefused(const Material& made,
                   const RdDataset& dataset,
                   const FactorOptions& options,
                   const char* says) {
  try {
    FactorAgain(made, dataset, options);
    FAIL() << says;
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr(says));
  }
}

TEST(Reuse, OtherMethodsAndDataAreRefused) {
  RdDataset dataset = MakeChessboard({.points_x = 10, .points_y = 8, .core = 5});
  dataset.header.provenance = R"({"command":"a"})";
  const FactorOptions options{.method = "svd", .terms = 3};
  const Material made = Factor(dataset, options).material;
  ExpectRefused(made, dataset, {.method = "log-svd"}, "by method svd");
  const FactorOptions tucker{.method = "tucker", .terms = 2};
  ExpectRefused(Factor(dataset, tucker).material, dataset, tucker, "can be kept");
  const auto other = MakeChessboard({.points_x = 8, .points_y = 10, .core = 5});
  ExpectRefused(made, other, options, "10 x 8 points");
  Material fewer = made;
  fewer.channels = {"R", "G", "850nm"};
  ExpectRefused(fewer, dataset, options, "its channels");
  Material wider = made;
  wider.pitch_mm *= 2;
  ExpectRefused(wider, dataset, options, "its pitch");
  RdDataset changed = dataset;
  changed.header.provenance = R"({"command":"b"})";
  ExpectRefused(made, changed, options, "names another dataset");
  changed.header.provenance.clear();
  for (std::size_t n = 0; n < changed.rd.size(); n += 5) {
    changed.rd[n] *= 2;
  }
  ExpectRefused(made, changed, options, "where it says");
}

}  // namespace
}  // namespace nacre::factor

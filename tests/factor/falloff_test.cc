// SVDs of slices over the mean fall-off.

#include "core/error.h"
#include "factor/factor.h"
#include "factor/internal/mean_slice.h"
#include "tests/factor/exact_svd.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace nacre::factor {
namespace {

using nacre::testing::MakeChessboard;
using reconstruct::RdDataset;
using ::testing::HasSubstr;

FactorOptions Divided(const std::string& method, int terms) {
  return {.method = method, .terms = terms, .bits = 32, .divide_falloff = true};
}

double DifferenceOf(const Material& a, const Material& b) {
  double difference = 0;
  double size = 0;
  std::vector<float> of_a(static_cast<std::size_t>(a.WindowSize()));
  std::vector<float> of_b(of_a.size());
  for (int point = 0; point < a.points_x * a.points_y; point += 7) {
    a.EvaluateWindow(1, point % a.points_x, point / a.points_x, of_a.data());
    b.EvaluateWindow(1, point % a.points_x, point / a.points_x, of_b.data());
    for (std::size_t cell = 0; cell < of_a.size(); ++cell) {
      difference += std::pow(static_cast<double>(of_a[cell] - of_b[cell]), 2);
      size += std::pow(static_cast<double>(of_a[cell]), 2);
    }
  }
  return std::sqrt(difference / size);
}

// Against Eigen's decomposition of the divided matrix, and from its file.
TEST(Falloff, IsTheTruncatedSvdOfDividedRows) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 16, .points_y = 12, .core = 7, .channels = 1});
  const auto scan = internal::Scan(*internal::SourceOf(dataset), 1)[0];
  const std::vector<double> g = internal::MeanFalloff(scan);
  Eigen::MatrixXd y(192, 49);
  for (int p = 0; p < 192; ++p) {
    for (int d = 0; d < 49; ++d) {
      const auto cell = static_cast<std::size_t>(d);
      y(p, d) = static_cast<double>(dataset.Window(p, 0)[cell]) / g[cell];
    }
  }
  const Eigen::MatrixXd oracle = nacre::testing::ComputeExactSvd(y).OfRank(4);
  const nacre::testing::TempFolder folder;
  WriteMaterial(folder / "m.nacre.exr", Factor(dataset, Divided("svd", 4)).material);
  const Material m = ReadMaterial(folder / "m.nacre.exr");
  std::vector<float> window(49);
  for (int p = 0; p < 192; ++p) {
    m.EvaluateTerms(0, p % 16, p / 16, 4, window.data());
    for (int d = 0; d < 49; ++d) {
      const auto cell = static_cast<std::size_t>(d);
      ASSERT_NEAR(static_cast<double>(window[cell]) / g[cell], oracle(p, d), 1e-5);
    }
  }
}

// As the mean slice is a term, tails are.
TEST(Falloff, LowersTheLogError) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 24, .points_y = 24, .core = 15, .noise = 1e-5});
  for (const std::string method : {"svd", "sqrt-svd"}) {
    const auto divided = Factor(dataset, Divided(method, 5)).summary;
    const auto plain =
        Factor(dataset, {.method = method, .terms = 5, .bits = 32}).summary;
    // The root evens out half of it already.
    EXPECT_LT(divided.log_rms, (method == "svd" ? 0.8 : 0.95) * plain.log_rms);
    EXPECT_LT(divided.worst_total, 1e-5);
  }
}

TEST(Falloff, BlocksAndSumsGiveTheSame) {
  const RdDataset dataset =
      MakeChessboard({.points_x = 96, .points_y = 90, .core = 9, .channels = 2});
  for (const char* method : {"svd", "sqrt-svd"}) {
    const auto blocks = Factor(dataset, Divided(method, 4));
    FactorOptions sums = Divided(method, 4);
    sums.one_by_one = true;
    EXPECT_LT(DifferenceOf(Factor(dataset, sums).material, blocks.material), 2e-4)
        << method;
  }
}

TEST(Falloff, IsNotForTheLogarithm) {
  const RdDataset dataset = nacre::testing::MakeConstant(3, 3, 3, 1);
  try {
    Factor(dataset, Divided("log-svd", 2));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_THAT(e.what(), HasSubstr("divide_falloff"));
  }
}

}  // namespace
}  // namespace nacre::factor

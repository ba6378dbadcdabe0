#include "cli/exchange/profile_fit.h"

#include "tests/cli/exchange/burley_dataset.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace nacre::exchange {
namespace {

using testing::BurleyDataset;

ProfileFit FitOf(const reconstruct::RdDataset& data) {
  const testing::TempFolder folder;
  reconstruct::WriteDataset(folder / "x.rd.exr", data);
  reconstruct::RdReader reader(folder / "x.rd.exr");
  return FitProfiles(reader, 1);
}

TEST(ProfileFit, FindsTheProfileItIsGiven) {
  const auto parameters = [](int c, int i, int j) {
    return std::pair(0.2 + 0.2 * c + 0.03 * i, 0.3 + 0.25 * j + 0.1 * i);
  };
  const ProfileFit fit = FitOf(BurleyDataset(4, 31, parameters));
  const std::size_t pixels = fit.maps.PixelCount();
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) {
        const auto [albedo, d_mm] = parameters(c, i, j);
        const std::size_t n =
            static_cast<std::size_t>(c) * pixels + static_cast<std::size_t>(j * 4 + i);
        EXPECT_NEAR(fit.maps.albedo[n], albedo, 0.005 * albedo);
        EXPECT_NEAR(fit.maps.d_mm[n], d_mm, 0.01 * d_mm);
      }
    }
  }
  // Lengths are tabulated 6 % apart; the residual is that of the nearest.
  EXPECT_LT(fit.summary.worst_residual, 6e-3);
  EXPECT_EQ(fit.summary.above_one, 0);
  EXPECT_EQ(fit.summary.at_the_limit, 0);
}

TEST(ProfileFit, CellsThatWerentMeasuredCountAsTheirRing) {
  auto data = BurleyDataset(1, 31, [](int, int, int) { return std::pair(0.6, 0.7); });
  for (std::size_t n = 1; n < data.rd.size(); n += 5) {
    data.valid[n] = 0;
    data.rd[n] = 0;
  }
  const ProfileFit fit = FitOf(data);
  EXPECT_NEAR(fit.maps.albedo[0], 0.6, 0.03);
  EXPECT_NEAR(fit.maps.d_mm[0], 0.7, 0.05);
}

TEST(ProfileFit, SaysWhatIsNoProfile) {
  auto data = BurleyDataset(1, 15, [](int, int, int) { return std::pair(1.4, 0.5); });
  std::fill(
      data.rd.begin() + 2 * 225, data.rd.end(), 0.0F);  // the last channel is dark
  const ProfileFit fit = FitOf(data);
  EXPECT_EQ(fit.summary.above_one, 2);
  EXPECT_EQ(fit.summary.unlit, 1);
  EXPECT_EQ(fit.maps.albedo[0], 1);
  EXPECT_EQ(fit.maps.albedo[2], 0);
  EXPECT_GT(fit.maps.d_mm[2], 0);
  // A window as bright at its edge as in the middle has no length.
  std::fill(data.rd.begin(), data.rd.end(), 0.001F);
  EXPECT_EQ(FitOf(data).summary.at_the_limit, 3);
}

}  // namespace
}  // namespace nacre::exchange

// Tails beyond the windows: exact where the form is exact, reciprocal between
// materials.

#include "reconstruct/internal/tails.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

RdHeader Header() {
  RdHeader header;
  header.points_x = 40;
  header.points_y = 1;
  header.core = 15;
  header.pitch_mm = 0.5;
  header.channels = {"R", "G"};
  return header;
}

double Tail(double r_mm, double decay_per_mm) {
  return 0.02 * std::exp(-decay_per_mm * r_mm) / (r_mm * r_mm);
}

RdSlice Slice(const RdHeader& header, double decay_per_mm) {
  RdSlice slice = MakeSlice(header);
  const auto window = static_cast<std::size_t>(header.WindowSize());
  for (std::size_t k = 0; k < slice.rd.size(); ++k) {
    const int cell = static_cast<int>(k % window);
    const PointMm d = header.Offset(cell % header.core, cell / header.core);
    const double r_mm = std::max(0.2, std::hypot(d.x, d.y));
    const double channel = k < window ? 1 : 2;
    slice.rd[k] = static_cast<float>(channel * Tail(r_mm, decay_per_mm));
  }
  return slice;
}

TEST(TailMap, ContinuesAnExponentialTail) {
  const RdHeader header = Header();
  TailMap tails(header);
  for (int i = 0; i < header.points_x; ++i) {
    tails.Fit(i, 0, Slice(header, 0.5), 1.0);
  }
  for (const int du : {8, -12, 25}) {
    for (const int dv : {0, 5, -9}) {
      const double r_mm = 0.5 * std::hypot(du, dv);
      EXPECT_NEAR(static_cast<double>(tails.Extrapolate(20, 0, 0, du, dv)),
                  Tail(r_mm, 0.5),
                  0.02 * Tail(r_mm, 0.5))
          << du << ' ' << dv;
      EXPECT_NEAR(static_cast<double>(tails.Extrapolate(20, 0, 1, du, dv)),
                  2 * Tail(r_mm, 0.5),
                  0.04 * Tail(r_mm, 0.5));
    }
  }
  EXPECT_EQ(tails.Extrapolate(20, 0, 0, tails.Reach() + 1, 0), 0.0F);
}

TEST(TailMap, BetweenTwoMaterialsIsTheSameBothWays) {
  const RdHeader header = Header();
  TailMap tails(header);
  for (int i = 0; i < header.points_x; ++i) {
    tails.Fit(i, 0, Slice(header, i < 20 ? 0.4 : 0.8), 1.0);
  }
  const float there = tails.Extrapolate(10, 0, 0, 20, 0);
  const float back = tails.Extrapolate(30, 0, 0, -20, 0);
  EXPECT_FLOAT_EQ(there, back);
  EXPECT_NEAR(static_cast<double>(there), Tail(10, 0.6), 0.03 * Tail(10, 0.6));
}

TEST(TailMap, NoiseHasNoTail) {
  const RdHeader header = Header();
  TailMap tails(header);
  RdSlice slice = Slice(header, 0.5);
  slice.sigma.assign(slice.sigma.size(), 1.0F);
  tails.Fit(20, 0, slice, 1.0);
  EXPECT_EQ(tails.Extrapolate(20, 0, 0, 10, 0), 0.0F);
  EXPECT_EQ(TailMap(header).Extrapolate(20, 0, 0, 10, 0), 0.0F);
}

}  // namespace
}  // namespace nacre::reconstruct::internal

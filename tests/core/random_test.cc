#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nacre {
namespace {

// Known answers of philox4x32-10, distributed with [Salmon11]'s library (kat_vectors).
TEST(Philox, MatchesTheKnownAnswers) {
  using Counter = std::array<std::uint32_t, 4>;
  EXPECT_EQ(Philox({0, 0, 0, 0}, {0, 0}),
            (Counter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(Philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
                   {0xffffffff, 0xffffffff}),
            (Counter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(Philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
                   {0xa4093822, 0x299f31d0}),
            (Counter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(RandomStream, IsUniformAndItsStreamsDiffer) {
  double sum = 0;
  double square = 0;
  double product = 0;
  RandomStream a(1, 0);
  RandomStream b(1, 1);
  constexpr int kCount = 100'000;
  for (int i = 0; i < kCount; ++i) {
    const double x = a.Uniform() - 0.5;
    const double y = b.Uniform() - 0.5;
    sum += x;
    square += x * x;
    product += x * y;
  }
  const double sigma = 1 / std::sqrt(12.0 * kCount);
  EXPECT_LT(std::abs(sum / kCount), 4 * sigma);
  EXPECT_NEAR(square / kCount, 1.0 / 12, 4 / std::sqrt(180.0 * kCount));
  EXPECT_LT(std::abs(product / kCount), 4.0 / 12 / std::sqrt(kCount));
}

}  // namespace
}  // namespace nacre

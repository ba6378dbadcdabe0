#include "rigs/transport/monte_carlo/threefry.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

namespace nacre::rigs::monte_carlo {
namespace {

using Block = std::array<std::uint32_t, 4>;

// Known answers of Random123 for the default of twenty rounds.
TEST(Threefry, GivesTheKnownAnswers) {
  constexpr std::uint32_t kOnes = 0xFFFFFFFFU;
  EXPECT_EQ(Threefry<20>({0, 0, 0, 0}, {0, 0, 0, 0}),
            (Block{0x9C6CA96AU, 0xE17EAE66U, 0xFC10ECD4U, 0x5256A7D8U}));
  EXPECT_EQ(Threefry<20>({kOnes, kOnes, kOnes, kOnes}, {kOnes, kOnes, kOnes, kOnes}),
            (Block{0x2A881696U, 0x57012287U, 0xF6C7446EU, 0xA16A6732U}));
  EXPECT_EQ(Threefry<20>({0x243F6A88U, 0x85A308D3U, 0x13198A2EU, 0x03707344U},
                         {0xA4093822U, 0x299F31D0U, 0x082EFA98U, 0xEC4E6C89U}),
            (Block{0x59CD1DBBU, 0xB8879579U, 0x86B5D00CU, 0xAC8B6D84U}));
}

TEST(Threefry, EveryWordOfCounterAndKeyMatters) {
  const Block base = Threefry({1, 2, 3, 4}, {5, 6, 7, 8});
  EXPECT_NE(base, Threefry({2, 2, 3, 4}, {5, 6, 7, 8}));
  EXPECT_NE(base, Threefry({1, 3, 3, 4}, {5, 6, 7, 8}));
  EXPECT_NE(base, Threefry({1, 2, 4, 4}, {5, 6, 7, 8}));
  EXPECT_NE(base, Threefry({1, 2, 3, 4}, {6, 6, 7, 8}));
  EXPECT_NE(base, Threefry({1, 2, 3, 4}, {5, 7, 7, 8}));
  EXPECT_NE(base, Threefry({1, 2, 3, 4}, {5, 6, 8, 8}));
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo

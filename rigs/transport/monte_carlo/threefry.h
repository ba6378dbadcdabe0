#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace nacre::rigs::monte_carlo {

inline constexpr std::uint32_t kThreefryParity = 0x1BD11BDAU;
inline constexpr std::array<std::array<int, 2>, 8> kThreefryRotations{
    {{10, 26}, {11, 21}, {13, 27}, {23, 5}, {6, 20}, {17, 11}, {25, 10}, {18, 20}}};

/// Threefry 4×32 [Salmon11, section 4.2]: four random words as a function of counter
/// and key. Twelve rounds are the fewest that pass BigCrush; the photons use these.
template <int kRounds = 12>
constexpr std::array<std::uint32_t, 4> Threefry(std::array<std::uint32_t, 4> x,
                                                std::array<std::uint32_t, 4> key) {
  const std::array<std::uint32_t, 5> k{
      key[0],
      key[1],
      key[2],
      key[3],
      kThreefryParity ^ key[0] ^ key[1] ^ key[2] ^ key[3]};
  for (unsigned i = 0; i < 4; ++i) {
    x[i] += k[i];
  }
  for (unsigned round = 0; round < kRounds; ++round) {
    const unsigned a = round % 2 == 0 ? 1 : 3;
    const unsigned b = 4 - a;
    const auto& rotation = kThreefryRotations[round % 8];
    x[0] += x[a];
    x[a] = std::rotl(x[a], rotation[0]) ^ x[0];
    x[2] += x[b];
    x[b] = std::rotl(x[b], rotation[1]) ^ x[2];
    if (round % 4 == 3) {
      const unsigned s = round / 4 + 1;
      for (unsigned i = 0; i < 4; ++i) {
        x[i] += k[(s + i) % 5];
      }
      x[3] += s;
    }
  }
  return x;
}

}  // namespace nacre::rigs::monte_carlo

#pragma once

#include <array>
#include <cstdint>

namespace nacre {

/// Philox 4×32-10 [Salmon11]: random numbers that are a pure function of key and
/// counter, so that the same seed gives the same numbers whatever the thread count or
/// order.
constexpr std::array<std::uint32_t, 4> Philox(std::array<std::uint32_t, 4> counter,
                                              std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = std::uint64_t{0xD2511F53u} * counter[0];
    const std::uint64_t p1 = std::uint64_t{0xCD9E8D57u} * counter[2];
    counter = {static_cast<std::uint32_t>(p1 >> 32) ^ counter[1] ^ key[0],
               static_cast<std::uint32_t>(p1),
               static_cast<std::uint32_t>(p0 >> 32) ^ counter[3] ^ key[1],
               static_cast<std::uint32_t>(p0)};
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
  return counter;
}

/// A stream of numbers named by (seed, stream); draws advance an internal counter.
/// Satisfies UniformRandomBitGenerator, but prefer Uniform(): the standard
/// distributions differ between libraries.
class RandomStream {
 public:
  using result_type = std::uint32_t;
  RandomStream(std::uint64_t seed, std::uint64_t stream)
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
        stream_{static_cast<std::uint32_t>(stream),
                static_cast<std::uint32_t>(stream >> 32)} {}

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return 0xFFFFFFFFu; }

  result_type operator()() {
    if (used_ == 4) {
      block_ = Philox({static_cast<std::uint32_t>(counter_),
                       static_cast<std::uint32_t>(counter_ >> 32),
                       stream_[0],
                       stream_[1]},
                      key_);
      ++counter_;
      used_ = 0;
    }
    return block_[used_++];
  }

  /// In [0, 1), 32 bits of it.
  double Uniform() { return (*this)() * 0x1p-32; }

  /// In [0, 1), a float's 24 bits of it: never rounds to 1.
  float UniformFloat() { return static_cast<float>((*this)() >> 8) * 0x1p-24F; }

 private:
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 2> stream_;
  std::uint64_t counter_ = 0;
  std::array<std::uint32_t, 4> block_{};
  unsigned used_ = 4;
};

}  // namespace nacre

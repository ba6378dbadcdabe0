#include "render/sampler.h"

namespace nacre::render {
namespace {

std::uint64_t Mix(std::uint64_t x) {  // the finaliser of SplitMix64 [Steele14]
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

std::uint32_t ReverseBits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0F0F0F0Fu) << 4) | ((x >> 4) & 0x0F0F0F0Fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// Each bit is flipped by a hash of the bits below it [Laine & Karras 11], with the
// constants of [Vegdahl21]; between two bit reversals that is an Owen scramble.
std::uint32_t ScrambleLowToHigh(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3D20ADEAu;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526C56u;
  x ^= x * 0x53A22864u;
  return x;
}

// The second Sobol' dimension of index x, most significant bit first: multiplication by
// Pascal's triangle modulo 2, in log₂ 32 steps because Pascal's matrix is a product of
// Kronecker powers of ((1, 1), (0, 1)).
std::uint32_t SecondSobol(std::uint32_t x) {
  x ^= (x & 0xAAAAAAAAu) >> 1;
  x ^= (x & 0xCCCCCCCCu) >> 2;
  x ^= (x & 0xF0F0F0F0u) >> 4;
  x ^= (x & 0xFF00FF00u) >> 8;
  x ^= (x & 0xFFFF0000u) >> 16;
  return ReverseBits(x);
}

float ToUnit(std::uint32_t x) {
  return static_cast<float>(x >> 8) * 0x1p-24F;
}

}  // namespace

std::uint64_t MixSeed(std::uint64_t seed, std::uint64_t index) {
  return Mix(seed + 0x9E3779B97F4A7C15u * (index + 1));
}

Vec2 SobolPoint(std::uint32_t index) {
  return {ToUnit(ReverseBits(index)), ToUnit(SecondSobol(index))};
}

float Sampler::Next1D() {
  const std::uint64_t hash = MixSeed(seed_, dimension_++);
  const auto low = static_cast<std::uint32_t>(hash);
  const auto high = static_cast<std::uint32_t>(hash >> 32);
  // An Owen-scrambled radical inverse is the scrambled index, reversed; the shuffle of
  // the index is a scramble of its own, high bits first.
  const std::uint32_t shuffled =
      ReverseBits(ScrambleLowToHigh(ReverseBits(index_), low));
  return ToUnit(ReverseBits(ScrambleLowToHigh(shuffled, high)));
}

Vec2 Sampler::Next2D() {
  const std::uint64_t hash = MixSeed(seed_, dimension_++);
  const auto low = static_cast<std::uint32_t>(hash);
  const auto high = static_cast<std::uint32_t>(hash >> 32);
  const std::uint32_t shuffled =
      ReverseBits(ScrambleLowToHigh(ReverseBits(index_), low));
  const std::uint32_t x = ReverseBits(ScrambleLowToHigh(shuffled, high));
  const std::uint32_t y = ReverseBits(
      ScrambleLowToHigh(ReverseBits(SecondSobol(shuffled)), low ^ 0x9E3779B9u));
  return {ToUnit(x), ToUnit(y)};
}

}  // namespace nacre::render

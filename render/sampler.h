#pragma once

#include "render/vec.h"

#include <cstdint>

namespace nacre::render {

/// Owen-scrambled, index-shuffled (0, 2) Sobol' points, a pair of dimensions at a time
/// [Burley20]: sample `index` of the sequence named by `seed`, every call a new pair.
/// A pure function of its arguments, so that pictures don't depend on threads.
class Sampler {
 public:
  Sampler(std::uint64_t seed, std::uint32_t index) : seed_(seed), index_(index) {}

  float Next1D();  ///< in [0, 1)
  Vec2 Next2D();   ///< in [0, 1)²

 private:
  std::uint64_t seed_;
  std::uint32_t index_;
  std::uint32_t dimension_ = 0;
};

/// Point `index` of the (0, 2) sequence itself [Sobol67], not scrambled, in [0, 1)².
Vec2 SobolPoint(std::uint32_t index);

/// A seed made of a seed and an index (pixel, point, …): neighbours are unrelated.
std::uint64_t MixSeed(std::uint64_t seed, std::uint64_t index);

}  // namespace nacre::render

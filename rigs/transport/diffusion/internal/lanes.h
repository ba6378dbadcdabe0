#pragma once

#include <cstddef>

namespace nacre::rigs::diffusion::internal {

/// One number for each of the right-hand sides that are solved together: 64 bytes, the
/// widest register there is; narrower machines take it in pieces.
template <class Real>
struct alignas(64) Lanes {
  typedef Real Vector __attribute__((vector_size(64)));
  static constexpr std::size_t kCount = 64 / sizeof(Real);
  Vector v = {};
};

}  // namespace nacre::rigs::diffusion::internal

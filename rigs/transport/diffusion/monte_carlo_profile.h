#pragma once

#include "rigs/phantom.h"
#include "rigs/transport/analytic/robin_slab.h"

#include <cstddef>
#include <cstdint>
#include <functional>

namespace nacre {
class Ranks;
}

namespace nacre::rigs::diffusion {

struct MonteCarloProfileRequest {
  std::size_t medium = 0;
  std::size_t channel = 0;
  double last_mm = 1;  ///< counted as far as this
  std::int64_t photon_count = 0;
  std::int64_t seed = 1;
  int thread_count = 0;
  const Ranks* ranks = nullptr;
};

/// R_d(r), mm⁻², of a homogeneous slab of one of the phantom's media lit by a pencil:
/// `model` (diffusion of the same slab) times the ratio Monte Carlo / model, which is
/// smooth and so needs few photons. The ratio is found ring by ring, as far out as
/// rings get 2000 photons (2 % noise), and kept from there on.
///
/// Throws BadData for a medium that doesn't absorb in an infinitely thick slab, where
/// Monte Carlo never ends.
std::function<double(double r_mm)> MonteCarloProfile(
    const Phantom& phantom,
    const MonteCarloProfileRequest& request,
    const RobinSlab& model);

}  // namespace nacre::rigs::diffusion

#include "rigs/light_noise.h"

#include "core/random.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace nacre::rigs {
namespace {

constexpr std::uint64_t kRippleKey = 0x726970706C650000U;
constexpr std::uint64_t kSpeckleKey = 0x737065636B6C0000U;

// Of what decides the interference: the spots' places, colour and what they fall on.
std::uint64_t SceneNumber(const World& world) {
  std::uint64_t number = static_cast<std::uint64_t>(world.target) * 64 +
                         static_cast<std::uint64_t>(world.channel);
  const auto add = [&](double value) {
    number = (number ^ std::bit_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15U;
    number ^= number >> 29;
  };
  for (const Spot& spot : world.spots) {
    add(spot.centre_mm.x);
    add(spot.centre_mm.y);
  }
  return number;
}

}  // namespace

void AddRipple(double ripple,
               std::uint64_t seed,
               std::uint64_t picture_number,
               std::vector<Spot>& spots) {
  for (Spot& spot : spots) {
    RandomStream random(
        seed ^ kRippleKey,
        picture_number * 4096 + static_cast<std::uint64_t>(spot.beam % 4096));
    const double u = std::max(random.Uniform(), 0x1p-33);
    const double v = random.Uniform();
    const double normal =
        std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
    spot.power *= std::max(0.0, 1 + ripple * normal);
  }
}

void AddSpeckle(double contrast,
                std::uint64_t seed,
                const World& world,
                std::vector<float>& picture) {
  RandomStream random(seed ^ kSpeckleKey, SceneNumber(world));
  const auto c = static_cast<float>(contrast);
  for (float& value : picture) {
    // Four uniform variables: normal enough, and bounded.
    float sum = -2.0F;
    for (int k = 0; k < 4; ++k) {
      sum += random.UniformFloat();
    }
    constexpr float kPerDeviation = 1.7320508F;
    value *= std::max(0.0F, 1.0F + c * kPerDeviation * sum);
  }
}

}  // namespace nacre::rigs

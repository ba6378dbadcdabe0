#pragma once

#include "core/options.h"
#include "rigs/world.h"

#include <cstdint>
#include <vector>

namespace nacre::rigs {

/// What a laser's light does beside shining steadily and evenly. All off by default.
struct LightNoiseModel {
  double drift_per_hour = 0;    ///< of the power, relative
  double ripple = 0;            ///< of a beam's power, anew in every picture; relative
  double speckle_contrast = 0;  ///< of a pixel, the same as long as nothing moves

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("drift_per_hour", self.drift_per_hour, Range{-1, 1}, "");
    visit("ripple", self.ripple, Range{0, 0.5}, "");
    visit("speckle_contrast", self.speckle_contrast, Range{0, 1}, "");
  }
};

/// Multiplies each beam's power by 1 + ripple · a normal variable of (seed, picture,
/// beam).
void AddRipple(double ripple,
               std::uint64_t seed,
               std::uint64_t picture_number,
               std::vector<Spot>& spots);

/// Multiplies each pixel by 1 + contrast · a variable of mean 0 and variance 1, never
/// below 0; a pure function of (seed, what is lit, pixel).
void AddSpeckle(double contrast,
                std::uint64_t seed,
                const World& world,
                std::vector<float>& picture);

}  // namespace nacre::rigs

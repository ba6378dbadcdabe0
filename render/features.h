#pragma once

#include "core/exr.h"
#include "render/scene.h"

#include <cstdint>

namespace nacre::render {

/// What each pixel of the crop window looks at, for denoisers: parts "albedo" (R, G, B;
/// what surfaces reflect of all light, in [0, 1]; 1 where that isn't known) and
/// "normal" (X, Y, Z, in the scene's axes). 0 where nothing is.
struct FeatureImages {
  ExrPart albedo;
  ExrPart normal;
};
FeatureImages FirstHitFeatures(const Scene& scene,
                               std::uint64_t seed,
                               int thread_count);

}  // namespace nacre::render

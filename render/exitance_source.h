#pragma once

#include "render/path_counters.h"
#include "render/sampler.h"
#include "render/shape.h"

#include <vector>

namespace nacre::render {

/// How well the picture shows what a path found.
enum class Sight {
  kSharp,    ///< from the camera, or in mirrors and things almost as sharp
  kDim,      ///< so too, but at little of its brightness
  kBlurred,  ///< as light from a wide angle
};

/// A question for the exitance at a hit, with what may serve to answer it.
struct ExitanceQuery {
  Sampler& sampler;
  PathCounters& counters;
  Sight sight;
};

/// Where a path tracer gets the exitance of one translucent shape from: M in W mm⁻², or
/// an unbiased estimate of it.
class ExitanceSource {
 public:
  virtual ~ExitanceSource() = default;
  virtual Color At(const SurfaceHit& hit, const ExitanceQuery& query) const = 0;
};

/// One a shape; null where opaque, or where what leaves isn't to be followed.
using ExitanceSources = std::vector<const ExitanceSource*>;

}  // namespace nacre::render

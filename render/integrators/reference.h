#pragma once

#include "render/entering_light.h"
#include "render/exitance_source.h"
#include "render/world.h"

#include <array>

namespace nacre::render {

/// The exitance by sampling where light enters, without patches, caches or
/// interpolation: unbiased, and as noisy as it comes. What the fast way is judged by.
///
/// Places x_i around x_o are found by lines [King13]: an axis, the normal or one of two
/// tangents at x_o; a distance from it, drawn from the model's own spread; all surfaces
/// of the shape that the line meets. Some places are drawn evenly from the whole
/// surface instead, which catches what no axis sees well. The four ways are combined by
/// the balance heuristic.
class ReferenceExitance final : public ExitanceSource {
 public:
  /// References must outlive it. `tracer` brings indirect light.
  ReferenceExitance(const World& world,
                    std::uint32_t shape_index,
                    const PathTracer& tracer,
                    bool indirect);

  Color At(const SurfaceHit& hit, const ExitanceQuery& query) const override;

 private:
  struct Place;
  Color FromPlace(const Place& x_o,
                  const SurfaceHit& hit_i,
                  const ExitanceQuery& query) const;
  float Density(const Place& x_o, const SurfaceHit& hit_i, Vec3 d_mm) const;

  const World& world_;
  std::uint32_t shape_index_;
  const Translucency& translucency_;
  EnteringLight light_;
  AreaSampler area_;
  float area_mm2_;
  RadialDensity spread_;
};

}  // namespace nacre::render

#pragma once

#include "render/subsurface/subsurface.h"

#include <array>
#include <cstddef>

namespace nacre::render {

/// Where on a measured sample a point of the surface lies, and which way d goes there.
enum class Mapping {
  kTexture,    ///< place by uv, d by the difference of uv times the local stretch
  kWorld,      ///< place by uv, d in space
  kBox,        ///< place by projection along the axis nearest to the normal
  kTriplanar,  ///< by all three, in proportion to the fourth power of the normal
};

/// The sample in space, for projections: millimetres and unit axes of the scene.
struct SamplePose {
  Vec3 centre_mm;
  Frame axes{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
};

/// A place on the sample, with the directions of its columns (+u) and rows (−v).
struct SamplePlace {
  Vec2 uv;
  Vec3 tangent_u;
  Vec3 tangent_v;
  float weight = 1;
};

struct SamplePlaces {
  std::array<SamplePlace, 3> place;
  std::size_t count = 0;
  const SamplePlace* begin() const { return place.data(); }
  const SamplePlace* end() const { return place.data() + count; }
};

class MaterialMapping {
 public:
  /// `width_mm`, `height_mm`: of the sample, after which it repeats.
  MaterialMapping(Mapping mapping,
                  const SamplePose& pose,
                  float width_mm,
                  float height_mm)
      : mapping_(mapping), pose_(pose), width_mm_(width_mm), height_mm_(height_mm) {}

  Mapping mapping() const { return mapping_; }

  /// One place, or up to three whose weights sum to 1.
  SamplePlaces Places(const SurfacePoint& point) const;

  /// x_o − x_i along the surface, in mm along the tangents at x_i, as the texture
  /// coordinates say: their difference times the mean of both places' stretch.
  static Vec2 AlongSurface(const SurfacePoint& x_i, const SurfacePoint& x_o);

 private:
  SamplePlace Projected(const SurfacePoint& point, int axis) const;

  Mapping mapping_;
  SamplePose pose_;
  float width_mm_;
  float height_mm_;
};

}  // namespace nacre::render

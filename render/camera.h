#pragma once

#include "render/transform.h"
#include "render/vec.h"

namespace nacre::render {

struct Ray {
  Vec3 origin;
  Vec3 direction;  ///< unit
  float t_min = 0;
  float t_max = std::numeric_limits<float>::infinity();
};

/// A pinhole. In its own frame it looks along +z with +y up and +x to the left.
struct Camera {
  Transform world_from_camera;
  /// Half the picture's width (of the full film, before cropping) at distance 1.
  float half_width = 0.5F;
  float near_clip = 0.01F;
  float far_clip = 10000;
};

enum class FovAxis { kX, kY, kDiagonal, kSmaller, kLarger };

/// Camera::half_width for a field of view along `axis`.
float HalfWidth(double fov_deg, FovAxis axis, int width, int height);

/// The ray through a film position in pixels; (0, 0) is the upper left corner of a film
/// of `width` × `height` square pixels.
Ray CameraRay(const Camera& camera, Vec2 position, int width, int height);

}  // namespace nacre::render

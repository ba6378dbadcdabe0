#include "render/camera.h"

#include "core/error.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::render {

float HalfWidth(double fov_deg, FovAxis axis, int width, int height) {
  if (!(fov_deg > 0 && fov_deg < 180)) {
    throw BadData(fmt::format(
        "a field of view of {} degrees; it must be above 0 and below 180", fov_deg));
  }
  const double half = std::tan(fov_deg * std::numbers::pi / 360);
  const double w = width;
  const double h = height;
  switch (axis) {
    case FovAxis::kX:
      return static_cast<float>(half);
    case FovAxis::kY:
      return static_cast<float>(half * w / h);
    case FovAxis::kDiagonal:
      return static_cast<float>(half * w / std::hypot(w, h));
    case FovAxis::kSmaller:
      return static_cast<float>(half * w / std::min(w, h));
    case FovAxis::kLarger:
      return static_cast<float>(half * w / std::max(w, h));
  }
  throw LogicError("unknown axis of the field of view");
}

Ray CameraRay(const Camera& camera, Vec2 position, int width, int height) {
  const float half_pixel = camera.half_width / (0.5F * static_cast<float>(width));
  const Vec3 local{-(position.x - 0.5F * static_cast<float>(width)) * half_pixel,
                   -(position.y - 0.5F * static_cast<float>(height)) * half_pixel,
                   1};
  const float length = Length(local);  // clipping planes are at a depth, not a distance
  return {camera.world_from_camera.Point({0, 0, 0}),
          Normalized(camera.world_from_camera.Vector(local)),
          camera.near_clip * length,
          camera.far_clip * length};
}

}  // namespace nacre::render

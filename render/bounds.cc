#include "render/bounds.h"

#include <algorithm>
#include <variant>

namespace nacre::render {

Box BoundsOf(const Shape& shape) {
  if (const auto* sphere = std::get_if<Sphere>(&shape.geometry)) {
    const Vec3 r{sphere->radius, sphere->radius, sphere->radius};
    return {sphere->center - r, sphere->center + r};
  }
  const auto& positions = std::get<TriangleMesh>(shape.geometry).positions;
  Box box{positions.front(), positions.front()};
  for (const Vec3 p : positions) {
    box.low = {
        std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x),
                std::max(box.high.y, p.y),
                std::max(box.high.z, p.z)};
  }
  return box;
}

}  // namespace nacre::render

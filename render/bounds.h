#pragma once

#include "render/shape.h"
#include "render/vec.h"

namespace nacre::render {

/// An axis-aligned box, scene units.
struct Box {
  Vec3 low;
  Vec3 high;
};

/// The smallest around a shape (a sphere, or a mesh with a vertex at least).
Box BoundsOf(const Shape& shape);

}  // namespace nacre::render

#include "render/subsurface/material_mapping.h"

#include <cmath>

namespace nacre::render {
namespace {

/// A projection whose share would be less is left out.
constexpr float kLeastShare = 0.01F;

int NearestAxis(Vec3 n) {
  const float x = std::abs(n.x);
  const float y = std::abs(n.y);
  const float z = std::abs(n.z);
  return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

}  // namespace

SamplePlaces MaterialMapping::Places(const SurfacePoint& point) const {
  SamplePlaces places;
  if (mapping_ == Mapping::kTexture || mapping_ == Mapping::kWorld) {
    places.place[0] = {point.uv, point.tangent_u, point.tangent_v, 1};
    places.count = 1;
    return places;
  }
  const Vec3 n = pose_.axes.ToLocal(point.normal);
  const int nearest = NearestAxis(n);
  if (mapping_ == Mapping::kBox) {
    places.place[places.count++] = Projected(point, nearest);
    return places;
  }
  std::array<float, 3> share{};
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float along = std::pow(n[axis], 4.0F);
    share[static_cast<std::size_t>(axis)] = along;
    sum += along;
  }
  float kept = 0;
  // The nearest first: it stands for the others where one has to.
  for (int k = 0; k < 3; ++k) {
    const int axis = (nearest + k) % 3;
    const float weight = share[static_cast<std::size_t>(axis)] / sum;
    if (weight >= kLeastShare) {
      places.place[places.count] = Projected(point, axis);
      places.place[places.count++].weight = weight;
      kept += weight;
    }
  }
  for (std::size_t k = 0; k < places.count; ++k) {
    places.place[k].weight /= kept;
  }
  return places;
}

// Seen from outside, each side of a box shows the sample upright: +y up, or on the
// sides whose normal is ±y, −z or +z.
SamplePlace MaterialMapping::Projected(const SurfacePoint& point, int axis) const {
  const float sign = Dot(pose_.axes.ToWorld({axis == 0 ? 1.0F : 0.0F,
                                             axis == 1 ? 1.0F : 0.0F,
                                             axis == 2 ? 1.0F : 0.0F}),
                         point.normal) < 0
                         ? -1.0F
                         : 1.0F;
  const Vec3 u = axis == 0   ? Vec3{0, 0, -sign}
                 : axis == 1 ? Vec3{1, 0, 0}
                             : Vec3{sign, 0, 0};
  const Vec3 v = axis == 1 ? Vec3{0, 0, -sign} : Vec3{0, 1, 0};
  const Vec3 local = pose_.axes.ToLocal(point.position_mm - pose_.centre_mm);
  SurfacePoint turned = point;
  SetTangents(turned, pose_.axes.ToWorld(u), pose_.axes.ToWorld(v));
  return {{Dot(local, u) / width_mm_ + 0.5F, Dot(local, v) / height_mm_ + 0.5F},
          turned.tangent_u,
          turned.tangent_v,
          1};
}

Vec2 MaterialMapping::AlongSurface(const SurfacePoint& x_i, const SurfacePoint& x_o) {
  const float du = x_o.uv.x - x_i.uv.x;
  const float dv = x_o.uv.y - x_i.uv.y;
  const Vec3 stretch = (x_i.stretch_mm + x_o.stretch_mm) * 0.5F;
  return {du * stretch.x + dv * stretch.y, dv * stretch.z};
}

}  // namespace nacre::render

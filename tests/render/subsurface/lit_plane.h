#pragma once

#include "core/random.h"
#include "render/subsurface/subsurface.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace nacre::render {

/// Surfaces to light, sampled by jittered points as a renderer would.
using LightAt = std::function<Color(Vec3 position_mm)>;

/// A square of the plane z = 0, spanned by (cos a, sin a) and (−sin a, cos a), facing
/// +z; texture coordinates are those of a sample of side `sample_mm` centred on the
/// origin.
struct PlaneShape {
  float side_mm = 40;
  float spacing_mm = 0.1F;
  float angle_rad = 0;
  float sample_mm = 40;

  SurfacePoint At(float s, float t) const {
    const float c = std::cos(angle_rad);
    const float n = std::sin(angle_rad);
    SurfacePoint p;
    p.position_mm = {c * s - n * t, n * s + c * t, 0};
    p.normal = {0, 0, 1};
    p.tangent_u = {1, 0, 0};
    p.tangent_v = {0, 1, 0};
    p.uv = {p.position_mm.x / sample_mm + 0.5F, p.position_mm.y / sample_mm + 0.5F};
    return p;
  }
};

inline std::vector<LitPoint> LightPlane(const PlaneShape& plane, const LightAt& light) {
  RandomStream random(7, 1);
  std::vector<LitPoint> lit;
  const int count = static_cast<int>(std::lround(plane.side_mm / plane.spacing_mm));
  for (int j = 0; j < count; ++j) {
    for (int i = 0; i < count; ++i) {
      const float s =
          (static_cast<float>(i) + random.UniformFloat()) * plane.spacing_mm -
          plane.side_mm / 2;
      const float t =
          (static_cast<float>(j) + random.UniformFloat()) * plane.spacing_mm -
          plane.side_mm / 2;
      LitPoint point;
      point.point = plane.At(s, t);
      point.area_mm2 = plane.spacing_mm * plane.spacing_mm;
      point.flux_density = light(point.point.position_mm);
      lit.push_back(point);
    }
  }
  return lit;
}

/// A sphere around the origin, (longitude, height) stratified so that areas are equal.
inline SurfacePoint SpherePoint(float radius_mm, float u, float height) {
  const float phi = 2 * std::numbers::pi_v<float> * u;
  const float ring = std::sqrt(std::max(0.0F, 1 - height * height));
  SurfacePoint p;
  p.normal = {ring * std::cos(phi), height, -ring * std::sin(phi)};
  p.position_mm = p.normal * radius_mm;
  p.tangent_u = {-std::sin(phi), 0, -std::cos(phi)};
  p.tangent_v = Cross(p.normal, p.tangent_u);
  p.uv = {u, 0.5F + 0.5F * height};
  return p;
}

inline std::vector<LitPoint> LightSphere(float radius_mm,
                                         float spacing_mm,
                                         const LightAt& light) {
  RandomStream random(7, 2);
  std::vector<LitPoint> lit;
  const float pi = std::numbers::pi_v<float>;
  const int rings = static_cast<int>(std::ceil(pi * radius_mm / spacing_mm));
  for (int j = 0; j < rings; ++j) {
    // Rings of equal width in angle, cut into near-squares.
    const float low = std::cos(pi * static_cast<float>(j) / static_cast<float>(rings));
    const float high =
        std::cos(pi * static_cast<float>(j + 1) / static_cast<float>(rings));
    const float ring_area = 2 * pi * radius_mm * radius_mm * (low - high);
    const int count =
        std::max(3, static_cast<int>(std::lround(ring_area / spacing_mm / spacing_mm)));
    for (int i = 0; i < count; ++i) {
      const float u =
          (static_cast<float>(i) + random.UniformFloat()) / static_cast<float>(count);
      LitPoint point;
      point.point =
          SpherePoint(radius_mm, u, high + (low - high) * random.UniformFloat());
      point.area_mm2 = ring_area / static_cast<float>(count);
      point.flux_density = light(point.point.position_mm);
      lit.push_back(point);
    }
  }
  return lit;
}

}  // namespace nacre::render

#pragma once

#include "render/vec.h"

#include <cmath>
#include <numbers>

namespace nacre::render {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;

/// Maps of the unit square. Each density is with respect to the measure named.

/// Uniform in the unit disk, of low distortion [Shirley & Chiu 97].
inline Vec2 SquareToDisk(Vec2 u) {
  const float x = 2 * u.x - 1;
  const float y = 2 * u.y - 1;
  if (x == 0 && y == 0) {
    return {0, 0};
  }
  const bool wide = std::abs(x) > std::abs(y);
  const float r = wide ? x : y;
  const float phi = wide ? kPi / 4 * (y / x) : kPi / 2 - kPi / 4 * (x / y);
  return {r * std::cos(phi), r * std::sin(phi)};
}

/// About +z, with density cos θ / π a steradian.
inline Vec3 SquareToCosineHemisphere(Vec2 u) {
  const Vec2 d = SquareToDisk(u);
  return {d.x, d.y, std::sqrt(std::max(1e-12F, 1 - d.x * d.x - d.y * d.y))};
}
inline float CosineHemispherePdf(float cos_theta) {
  return std::max(0.0F, cos_theta) * kInvPi;
}

/// With density 1 / (4 π) a steradian.
inline Vec3 SquareToSphere(Vec2 u) {
  const float z = 1 - 2 * u.x;
  const float r = std::sqrt(std::max(0.0F, 1 - z * z));
  const float phi = 2 * kPi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// About +z inside cos θ > cos_max, with density 1 / (2 π (1 − cos_max)) a steradian.
/// `one_minus_cos_max` is passed since it is what stays accurate for a narrow cone.
inline Vec3 SquareToCone(Vec2 u, float one_minus_cos_max) {
  const float a = u.x * one_minus_cos_max;  // 1 − cos θ
  const float r = std::sqrt(std::max(0.0F, a * (2 - a)));
  const float phi = 2 * kPi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), 1 - a};
}

/// Barycentric coordinates of corners 1 and 2, uniform in area; continuous and of low
/// distortion [Heitz 19].
inline Vec2 SquareToTriangle(Vec2 u) {
  if (u.y > u.x) {
    const float b = 0.5F * u.x;
    return {b, u.y - b};
  }
  const float b = 0.5F * u.y;
  return {u.x - b, b};
}

}  // namespace nacre::render

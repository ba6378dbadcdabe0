#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre::render {

/// Three floats: a point or direction in scene units, or a linear RGB colour.
struct Vec3 {
  float x = 0;
  float y = 0;
  float z = 0;

  constexpr float operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr Vec3& operator+=(Vec3 b) { return *this = {x + b.x, y + b.y, z + b.z}; }
  constexpr Vec3& operator*=(Vec3 b) { return *this = {x * b.x, y * b.y, z * b.z}; }
  constexpr Vec3& operator*=(float s) { return *this = {x * s, y * s, z * s}; }
};
using Color = Vec3;

constexpr Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr Vec3 operator-(Vec3 a) {
  return {-a.x, -a.y, -a.z};
}
constexpr Vec3 operator*(Vec3 a, Vec3 b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
constexpr Vec3 operator*(Vec3 a, float s) {
  return {a.x * s, a.y * s, a.z * s};
}
constexpr Vec3 operator*(float s, Vec3 a) {
  return a * s;
}
constexpr Vec3 operator/(Vec3 a, float s) {
  return {a.x / s, a.y / s, a.z / s};
}
constexpr bool operator==(Vec3 a, Vec3 b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}
constexpr float Dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr Vec3 Cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float Length(Vec3 a) {
  return std::sqrt(Dot(a, a));
}
inline Vec3 Normalized(Vec3 a) {
  return a / Length(a);
}
constexpr float MaxComponent(Vec3 a) {
  return std::max(a.x, std::max(a.y, a.z));
}
/// Luminance of linear sRGB [IEC 61966-2-1].
constexpr float Luminance(Color c) {
  return 0.2126F * c.x + 0.7152F * c.y + 0.0722F * c.z;
}

struct Vec2 {
  float x = 0;
  float y = 0;
};

/// An orthonormal frame around a unit normal n [Duff17].
struct Frame {
  Vec3 s;
  Vec3 t;
  Vec3 n;
  explicit Frame(Vec3 normal) : n(normal) {
    const float sign = std::copysign(1.0F, n.z);
    const float a = -1.0F / (sign + n.z);
    const float b = n.x * n.y * a;
    s = {1.0F + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  Frame(Vec3 s_axis, Vec3 t_axis, Vec3 normal) : s(s_axis), t(t_axis), n(normal) {}
  Vec3 ToLocal(Vec3 v) const { return {Dot(v, s), Dot(v, t), Dot(v, n)}; }
  Vec3 ToWorld(Vec3 v) const { return s * v.x + t * v.y + n * v.z; }
};

}  // namespace nacre::render

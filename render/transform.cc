#include "render/transform.h"

#include "core/error.h"

#include <cmath>
#include <cstdint>
#include <numbers>

namespace nacre::render {
namespace {

Vec3 MakeVec3(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

}  // namespace

Transform::Transform() : m_{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1} {}

Transform Transform::Translate(double x, double y, double z) {
  return Transform({1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1});
}

Transform Transform::Scale(double x, double y, double z) {
  return Transform({x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1});
}

Transform Transform::Rotate(Vec3 axis, double angle_deg) {
  const double ax = static_cast<double>(axis.x);
  const double ay = static_cast<double>(axis.y);
  const double az = static_cast<double>(axis.z);
  const double length = std::sqrt(ax * ax + ay * ay + az * az);
  if (!(length > 0)) {
    throw BadData("a rotation about an axis of length 0");
  }
  const double x = ax / length;
  const double y = ay / length;
  const double z = az / length;
  const double angle_rad = angle_deg * std::numbers::pi / 180;
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  const double k = 1 - c;
  return Transform({c + x * x * k,
                    x * y * k - z * s,
                    x * z * k + y * s,
                    0,
                    x * y * k + z * s,
                    c + y * y * k,
                    y * z * k - x * s,
                    0,
                    x * z * k - y * s,
                    y * z * k + x * s,
                    c + z * z * k,
                    0,
                    0,
                    0,
                    0,
                    1});
}

Transform Transform::LookAt(Vec3 origin, Vec3 target, Vec3 up) {
  const Vec3 view = target - origin;
  if (!(Length(view) > 0)) {
    throw BadData("lookat: origin and target are the same point");
  }
  const Vec3 forward = Normalized(view);
  const Vec3 side = Cross(up, forward);
  if (!(Length(side) > 1e-6F * Length(up))) {
    throw BadData("lookat: up is parallel to the direction of view");
  }
  const Vec3 left = Normalized(side);
  const Vec3 top = Cross(forward, left);
  std::array<double, 16> m{};
  for (int row = 0; row < 3; ++row) {
    const auto r = static_cast<std::size_t>(4 * std::int64_t{row});
    m[r] = static_cast<double>(left[row]);
    m[r + 1] = static_cast<double>(top[row]);
    m[r + 2] = static_cast<double>(forward[row]);
    m[r + 3] = static_cast<double>(origin[row]);
  }
  m[15] = 1;
  return Transform(m);
}

Transform Transform::operator*(const Transform& first) const {
  std::array<double, 16> m{};
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      for (std::size_t k = 0; k < 4; ++k) {
        m[4 * row + column] += m_[4 * row + k] * first.m_[4 * k + column];
      }
    }
  }
  return Transform(m);
}

double Transform::operator()(int row, int column) const {
  return m_[static_cast<std::size_t>(4 * std::int64_t{row} + column)];
}

Vec3 Transform::Vector(Vec3 v) const {
  const double x = static_cast<double>(v.x);
  const double y = static_cast<double>(v.y);
  const double z = static_cast<double>(v.z);
  return MakeVec3(m_[0] * x + m_[1] * y + m_[2] * z,
                  m_[4] * x + m_[5] * y + m_[6] * z,
                  m_[8] * x + m_[9] * y + m_[10] * z);
}

Vec3 Transform::Point(Vec3 p) const {
  const double x = static_cast<double>(p.x);
  const double y = static_cast<double>(p.y);
  const double z = static_cast<double>(p.z);
  return MakeVec3(m_[0] * x + m_[1] * y + m_[2] * z + m_[3],
                  m_[4] * x + m_[5] * y + m_[6] * z + m_[7],
                  m_[8] * x + m_[9] * y + m_[10] * z + m_[11]);
}

// Of the upper left 3 × 3: the inverse transpose times the determinant.
double Transform::Cofactor(int row, int column) const {
  const int r1 = (row + 1) % 3;
  const int r2 = (row + 2) % 3;
  const int c1 = (column + 1) % 3;
  const int c2 = (column + 2) % 3;
  return (*this)(r1, c1) * (*this)(r2, c2) - (*this)(r1, c2) * (*this)(r2, c1);
}

Vec3 Transform::Normal(Vec3 n) const {
  // The cofactors exist even where the inverse does not; the sign of the determinant
  // must be undone.
  std::array<double, 3> v{};
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      v[static_cast<std::size_t>(row)] += Cofactor(row, k) * static_cast<double>(n[k]);
    }
  }
  const double sign = Determinant() < 0 ? -1 : 1;
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  const double scale = length > 0 ? sign / length : 0;
  return MakeVec3(v[0] * scale, v[1] * scale, v[2] * scale);
}

Transform Transform::Inverse() const {
  const double determinant = Determinant();
  if (determinant == 0) {
    throw BadData("a transform that flattens has no inverse");
  }
  std::array<double, 16> m{};
  for (int row = 0; row < 3; ++row) {
    const auto start = static_cast<std::size_t>(4 * std::int64_t{row});
    for (int k = 0; k < 3; ++k) {
      const double entry = Cofactor(k, row) / determinant;
      m[start + static_cast<std::size_t>(k)] = entry;
      m[start + 3] -= entry * (*this)(k, 3);
    }
  }
  m[15] = 1;
  return Transform(m);
}

double Transform::Determinant() const {
  return m_[0] * (m_[5] * m_[10] - m_[6] * m_[9]) -
         m_[1] * (m_[4] * m_[10] - m_[6] * m_[8]) +
         m_[2] * (m_[4] * m_[9] - m_[5] * m_[8]);
}

}  // namespace nacre::render

#pragma once

#include "render/vec.h"

#include <array>

namespace nacre::render {

/// An affine (4 × 4, row-major) map of points, in double precision so that a chain of
/// rotations and its inverse stay exact to float.
class Transform {
 public:
  /// The identity.
  Transform();
  explicit Transform(const std::array<double, 16>& rows) : m_(rows) {}

  static Transform Translate(double x, double y, double z);
  static Transform Scale(double x, double y, double z);
  /// Counter-clockwise about `axis` (any length but 0), seen against it.
  static Transform Rotate(Vec3 axis, double angle_deg);
  /// The frame of something at `origin` that looks at `target`: +z goes there, +y goes
  /// up, +x to the left. Throws Error if up is parallel to the view.
  static Transform LookAt(Vec3 origin, Vec3 target, Vec3 up);

  /// `this` after `first`.
  Transform operator*(const Transform& first) const;

  Vec3 Point(Vec3 p) const;
  Vec3 Vector(Vec3 v) const;
  /// By the inverse transpose, unit length; outward stays outward under mirroring.
  Vec3 Normal(Vec3 n) const;
  /// Throws Error if there is none.
  Transform Inverse() const;
  double Determinant() const;  ///< of the upper left 3 × 3
  double operator()(int row, int column) const;

 private:
  double Cofactor(int row, int column) const;

  std::array<double, 16> m_;
};

}  // namespace nacre::render

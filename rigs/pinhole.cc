#include "rigs/pinhole.h"

#include "core/error.h"

#include <cmath>
#include <cstddef>

namespace nacre::rigs {
namespace {

double Dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vector3 Cross(const Vector3& a, const Vector3& b) {
  return {
      a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector3 Scaled(const Vector3& a, double s) {
  return {a[0] * s, a[1] * s, a[2] * s};
}

Vector3 Column(const Placement& placement, std::size_t k) {
  return {placement.rotation[0][k], placement.rotation[1][k], placement.rotation[2][k]};
}

}  // namespace

Vector3 Placement::Apply(const Vector3& point) const {
  Vector3 result = translation_mm;
  for (std::size_t k = 0; k < 3; ++k) {
    result[k] += Dot(rotation[k], point);
  }
  return result;
}

Placement operator*(const Placement& a_from_b, const Placement& b_from_c) {
  Placement product;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      product.rotation[row][column] =
          Dot(a_from_b.rotation[row], Column(b_from_c, column));
    }
  }
  product.translation_mm = a_from_b.Apply(b_from_c.translation_mm);
  return product;
}

PointMm LensDistortion::Distort(PointMm ideal) const {
  const double x = ideal.x;
  const double y = ideal.y;
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * k2);
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
          y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

PointMm LensDistortion::Undistort(PointMm distorted) const {
  // Distortion is a small perturbation of the identity: fixed point iteration gains a
  // factor of about |k1| r² a step.
  constexpr int kSteps = 30;
  PointMm ideal = distorted;
  for (int step = 0; step < kSteps; ++step) {
    const PointMm image = Distort(ideal);
    const double dx = distorted.x - image.x;
    const double dy = distorted.y - image.y;
    ideal.x += dx;
    ideal.y += dy;
    if (std::abs(dx) + std::abs(dy) < 1e-14) {
      break;
    }
  }
  return ideal;
}

Vector3 PinholeCamera::Position() const {
  Vector3 position{};
  for (std::size_t k = 0; k < 3; ++k) {
    position[k] =
        -Dot(Column(camera_from_sample, k), camera_from_sample.translation_mm);
  }
  return position;
}

PointMm PinholeCamera::RayFromPixel(double u, double v) const {
  return lens.Undistort({(u - centre_x_px) / focal_px, (v - centre_y_px) / focal_px});
}

PointMm PinholeCamera::SampleFromPixel(double u, double v) const {
  const PointMm ray = RayFromPixel(u, v);
  Vector3 direction{};
  for (std::size_t k = 0; k < 3; ++k) {
    direction[k] = Dot(Column(camera_from_sample, k), {ray.x, ray.y, 1});
  }
  const Vector3 from = Position();
  Expect(direction[2] * from[2] < 0, "a pixel that looks at the sample plane");
  const double distance = -from[2] / direction[2];
  return {from[0] + distance * direction[0], from[1] + distance * direction[1]};
}

PointMm PinholeCamera::PixelFromPoint(const Vector3& point) const {
  const Vector3 p = camera_from_sample.Apply(point);
  Expect(p[2] > 0, "a point in front of the camera");
  const PointMm image = lens.Distort({p[0] / p[2], p[1] / p[2]});
  return {centre_x_px + focal_px * image.x, centre_y_px + focal_px * image.y};
}

Placement LookAtOrigin(double distance_mm, double tilt_rad, double azimuth_rad) {
  const Vector3 towards_camera = {std::sin(tilt_rad) * std::cos(azimuth_rad),
                                  std::sin(tilt_rad) * std::sin(azimuth_rad),
                                  std::cos(tilt_rad)};
  const Vector3 view = Scaled(towards_camera, -1);
  const Vector3 up = {0, 1, 0};
  const double along = Dot(up, view);
  Vector3 down = {
      along * view[0] - up[0], along * view[1] - up[1], along * view[2] - up[2]};
  down = Scaled(down, 1 / std::sqrt(Dot(down, down)));
  Placement placement;
  placement.rotation = {Cross(down, view), down, view};
  placement.translation_mm = {0, 0, distance_mm};
  return placement;
}

}  // namespace nacre::rigs

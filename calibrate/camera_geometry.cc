#include "calibrate/calibration.h"
#include "core/error.h"

#include <cmath>

namespace nacre::calibrate {
namespace {

using Vector3 = std::array<double, 3>;

// A point of the plane z = 1 in front of an ideal lens, to where the real one puts it.
PixelPoint Distort(const CameraGeometry& camera, PixelPoint p) {
  const double r2 = p.x * p.x + p.y * p.y;
  const double radial = 1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  return {p.x * radial + 2 * camera.p1 * p.x * p.y + camera.p2 * (r2 + 2 * p.x * p.x),
          p.y * radial + camera.p1 * (r2 + 2 * p.y * p.y) + 2 * camera.p2 * p.x * p.y};
}

// The inverse, by fixed-point iteration: contracts as long as the distortion's slope is
// below one, which it is for anything one would call a lens.
PixelPoint Undistort(const CameraGeometry& camera, PixelPoint distorted) {
  constexpr int kMaxIterations = 60;
  constexpr double kTolerance = 1e-13;
  PixelPoint p = distorted;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const PixelPoint moved = Distort(camera, p);
    const double dx = distorted.x - moved.x;
    const double dy = distorted.y - moved.y;
    p.x += dx;
    p.y += dy;
    if (std::abs(dx) + std::abs(dy) < kTolerance) {
      break;
    }
  }
  return p;
}

}  // namespace

PixelPoint CameraGeometry::PixelFromSample(PointMm point) const {
  const auto& r = camera_from_sample_rotation;
  const auto& t = camera_from_sample_translation_mm;
  const Vector3 p{r[0] * point.x + r[1] * point.y + t[0],
                  r[3] * point.x + r[4] * point.y + t[1],
                  r[6] * point.x + r[7] * point.y + t[2]};
  const PixelPoint image = Distort(*this, {p[0] / p[2], p[1] / p[2]});
  return {fx_px * image.x + cx_px, fy_px * image.y + cy_px};
}

CameraGeometry CameraGeometry::OnPlane(const SamplePlane& plane) const {
  // sample_from_plane: columns are the plane's unit axes. The first lies above the
  // sample's x axis, the second at right angles to it in the plane.
  const double a = plane.slope_x;
  const double b = plane.slope_y;
  const double along = 1 / std::sqrt(1 + a * a);
  const double across = 1 / std::sqrt((1 + a * a) * (1 + a * a + b * b));
  const double up = 1 / std::sqrt(1 + a * a + b * b);
  const std::array<double, 9> axes{along,
                                   -a * b * across,
                                   -a * up,
                                   0,
                                   (1 + a * a) * across,
                                   -b * up,
                                   a * along,
                                   b * across,
                                   up};
  CameraGeometry camera = *this;
  const auto& r = camera_from_sample_rotation;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        sum += r[3 * row + k] * axes[3 * k + column];
      }
      camera.camera_from_sample_rotation[3 * row + column] = sum;
    }
    camera.camera_from_sample_translation_mm[row] += r[3 * row + 2] * plane.height_mm;
  }
  return camera;
}

PointMm CameraGeometry::SampleFromPixel(PixelPoint pixel) const {
  const PixelPoint ray =
      Undistort(*this, {(pixel.x - cx_px) / fx_px, (pixel.y - cy_px) / fy_px});
  // The ray (x, y, 1) s meets the plane where R (X, Y, 0) + t = s (x, y, 1): eliminate
  // s and solve the two equations for X and Y.
  const auto& r = camera_from_sample_rotation;
  const auto& t = camera_from_sample_translation_mm;
  const double a = r[0] - ray.x * r[6];
  const double b = r[1] - ray.x * r[7];
  const double c = r[3] - ray.y * r[6];
  const double d = r[4] - ray.y * r[7];
  const double e = ray.x * t[2] - t[0];
  const double f = ray.y * t[2] - t[1];
  const double determinant = a * d - b * c;
  return {(e * d - b * f) / determinant, (a * f - e * c) / determinant};
}

double CameraGeometry::CosOut(PointMm point) const {
  const auto& r = camera_from_sample_rotation;
  const auto& t = camera_from_sample_translation_mm;
  // The camera's centre in sample coordinates is −Rᵀ t.
  const double x = -(r[0] * t[0] + r[3] * t[1] + r[6] * t[2]) - point.x;
  const double y = -(r[1] * t[0] + r[4] * t[1] + r[7] * t[2]) - point.y;
  const double z = -(r[2] * t[0] + r[5] * t[1] + r[8] * t[2]);
  return z / std::sqrt(x * x + y * y + z * z);
}

double CameraGeometry::FootprintMm2(PixelPoint pixel) const {
  const PointMm right = SampleFromPixel({pixel.x + 0.5, pixel.y});
  const PointMm left = SampleFromPixel({pixel.x - 0.5, pixel.y});
  const PointMm below = SampleFromPixel({pixel.x, pixel.y + 0.5});
  const PointMm above = SampleFromPixel({pixel.x, pixel.y - 0.5});
  return std::abs((right.x - left.x) * (below.y - above.y) -
                  (right.y - left.y) * (below.x - above.x));
}

}  // namespace nacre::calibrate

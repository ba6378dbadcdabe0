#pragma once

#include "rigs/pattern.h"

#include <array>
#include <vector>

namespace nacre::rigs {

/// A point or direction in space, mm: sample coordinates unless said otherwise.
using Vector3 = std::array<double, 3>;

/// A rigid placement, p_a = rotation · p_b + translation for `a_from_b`.
struct Placement {
  std::array<Vector3, 3> rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< by row
  Vector3 translation_mm{};

  Vector3 Apply(const Vector3& point) const;
};

/// a_from_c = a_from_b · b_from_c.
Placement operator*(const Placement& a_from_b, const Placement& b_from_c);

/// Brown's lens distortion [Brown66] of normalised image coordinates (x, y), r² =
/// x²+y²:
///   x' = x (1 + k1 r² + k2 r⁴) + 2 p1 x y + p2 (r² + 2 x²)
///   y' = y (1 + k1 r² + k2 r⁴) + p1 (r² + 2 y²) + 2 p2 x y
struct LensDistortion {
  double k1 = 0;
  double k2 = 0;
  double p1 = 0;
  double p2 = 0;

  PointMm Distort(PointMm ideal) const;  ///< coordinates are pure numbers here
  PointMm Undistort(PointMm distorted) const;
};

/// A pinhole camera over the sample. Camera frame: x right, y down, z along the view.
/// Pixel (0, 0) is the centre of the upper left one.
struct PinholeCamera {
  int width_px = 0;
  int height_px = 0;
  double focal_px = 0;
  double centre_x_px = 0;
  double centre_y_px = 0;
  LensDistortion lens;
  Placement camera_from_sample;

  /// Where the camera stands.
  Vector3 Position() const;

  /// Normalised image coordinates that pixel position (u, v) looks along.
  PointMm RayFromPixel(double u, double v) const;
  /// The point of the sample plane that pixel position (u, v) sees.
  PointMm SampleFromPixel(double u, double v) const;
  /// The pixel position (x, y) of a point in space. Throws LogicError behind the
  /// camera.
  PointMm PixelFromPoint(const Vector3& point) const;
};

/// A camera that looks at the origin of the sample plane from `distance_mm`, leaned by
/// `tilt_rad` from the normal towards `azimuth_rad` (0: +x, π/2: +y); up in the picture
/// is +y of the sample. Rotation only; the caller fills in the rest.
Placement LookAtOrigin(double distance_mm, double tilt_rad, double azimuth_rad);

}  // namespace nacre::rigs

#include "rigs/plane_map.h"

#include "core/error.h"
#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace nacre::rigs {
namespace {

PlaneMap MapPixels(const PinholeCamera& camera,
                   int thread_count,
                   const std::function<PointMm(double u, double v)>& map) {
  PlaneMap result;
  result.width = camera.width_px;
  result.height = camera.height_px;
  const auto size = static_cast<std::size_t>(camera.width_px) *
                    static_cast<std::size_t>(camera.height_px);
  result.x.resize(size);
  result.y.resize(size);
  ParallelFor(camera.height_px, thread_count, [&](std::int64_t row) {
    for (int column = 0; column < camera.width_px; ++column) {
      const PointMm point = map(column, static_cast<double>(row));
      const std::size_t k = result.Index(column, static_cast<int>(row));
      result.x[k] = static_cast<float>(point.x);
      result.y[k] = static_cast<float>(point.y);
    }
  });
  return result;
}

}  // namespace

PointMm PlaneMap::At(int column, int row, double du, double dv) const {
  const std::size_t centre = Index(column, row);
  // Towards the side of the point, unless the picture ends there.
  const int beside = du >= 0 ? (column + 1 < width ? 1 : -1) : (column > 0 ? -1 : 1);
  const int above = dv >= 0 ? (row + 1 < height ? 1 : -1) : (row > 0 ? -1 : 1);
  const std::size_t along_u = Index(column + beside, row);
  const std::size_t along_v = Index(column, row + above);
  const auto mix = [&](const std::vector<float>& value) {
    const auto v = [&](std::size_t k) { return static_cast<double>(value[k]); };
    return v(centre) + du * beside * (v(along_u) - v(centre)) +
           dv * above * (v(along_v) - v(centre));
  };
  return {mix(x), mix(y)};
}

double PlaneMap::PixelSize() const {
  const PointMm left = At(width / 2, height / 2, -0.5, 0);
  const PointMm right = At(width / 2, height / 2, 0.5, 0);
  return std::hypot(right.x - left.x, right.y - left.y);
}

PlaneMap MapRays(const PinholeCamera& camera, int thread_count) {
  return MapPixels(camera, thread_count, [&](double u, double v) {
    return camera.RayFromPixel(u, v);
  });
}

PlaneMap MapSample(const PinholeCamera& camera, int thread_count) {
  return MapPixels(camera, thread_count, [&](double u, double v) {
    return camera.SampleFromPixel(u, v);
  });
}

PlaneMap MapPlane(const PlaneMap& rays, const Placement& camera_from_plane) {
  // In the plane's frame the camera stands at p and the ray runs along d; it meets
  // z = 0 at p − (p_z / d_z) d.
  const auto& r = camera_from_plane.rotation;
  const Vector3& t = camera_from_plane.translation_mm;
  Vector3 p{};
  for (std::size_t k = 0; k < 3; ++k) {
    p[k] = -(r[0][k] * t[0] + r[1][k] * t[1] + r[2][k] * t[2]);
  }
  PlaneMap map = rays;
  for (std::size_t i = 0; i < rays.x.size(); ++i) {
    const double u = static_cast<double>(rays.x[i]);
    const double v = static_cast<double>(rays.y[i]);
    Vector3 d{};
    for (std::size_t k = 0; k < 3; ++k) {
      d[k] = r[0][k] * u + r[1][k] * v + r[2][k];
    }
    Expect(d[2] * p[2] < 0, "a plane in front of the camera");
    const double distance = -p[2] / d[2];
    map.x[i] = static_cast<float>(p[0] + distance * d[0]);
    map.y[i] = static_cast<float>(p[1] + distance * d[1]);
  }
  return map;
}

}  // namespace nacre::rigs

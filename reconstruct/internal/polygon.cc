#include "reconstruct/internal/polygon.h"

#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// Keeps the side where a·x + b·y + c ≥ 0. Each clip of a convex polygon adds at most
// one corner.
Polygon ClipToHalfPlane(const Polygon& polygon, double a, double b, double c) {
  Polygon kept;
  for (std::size_t n = 0; n < polygon.count; ++n) {
    const Polygon::Corner p = polygon.corners[n];
    const Polygon::Corner q = polygon.corners[(n + 1) % polygon.count];
    const double p_side = a * p.x + b * p.y + c;
    const double q_side = a * q.x + b * q.y + c;
    if (p_side >= 0) {
      kept.Add(p);
    }
    if ((p_side > 0 && q_side < 0) || (p_side < 0 && q_side > 0)) {
      const double t = p_side / (p_side - q_side);
      kept.Add({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)});
    }
  }
  return kept;
}

}  // namespace

double Polygon::Area() const {
  double twice = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const Corner& p = corners[n];
    const Corner& q = corners[(n + 1) % count];
    twice += p.x * q.y - p.y * q.x;
  }
  return 0.5 * std::abs(twice);
}

Polygon::Corner Polygon::Centroid() const {
  // About the first corner, so that small polygons far away lose no digits.
  double twice = 0;
  double x = 0;
  double y = 0;
  for (std::size_t n = 1; n + 1 < count; ++n) {
    const Corner p{corners[n].x - corners[0].x, corners[n].y - corners[0].y};
    const Corner q{corners[n + 1].x - corners[0].x, corners[n + 1].y - corners[0].y};
    const double cross = p.x * q.y - p.y * q.x;
    twice += cross;
    x += cross * (p.x + q.x) / 3;
    y += cross * (p.y + q.y) / 3;
  }
  return {corners[0].x + x / twice, corners[0].y + y / twice};
}

Polygon::Squares Polygon::MeanSquares() const {
  double twice = 0;
  Squares sum;
  for (std::size_t n = 1; n + 1 < count; ++n) {
    const Corner& a = corners[0];
    const Corner& b = corners[n];
    const Corner& c = corners[n + 1];
    const double cross = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    twice += cross;
    // Of a triangle: by its corners and the sum of them.
    const double x = a.x + b.x + c.x;
    const double y = a.y + b.y + c.y;
    sum.xx += cross * (a.x * a.x + b.x * b.x + c.x * c.x + x * x) / 12;
    sum.yy += cross * (a.y * a.y + b.y * b.y + c.y * c.y + y * y) / 12;
    sum.xy += cross * (a.x * a.y + b.x * b.y + c.x * c.y + x * y) / 12;
  }
  return {sum.xx / twice, sum.yy / twice, sum.xy / twice};
}

Polygon ClipToBox(const Polygon& polygon, double x0, double y0, double x1, double y1) {
  return ClipToHalfPlane(
      ClipToHalfPlane(
          ClipToHalfPlane(ClipToHalfPlane(polygon, 1, 0, -x0), -1, 0, x1), 0, 1, -y0),
      0,
      -1,
      y1);
}

}  // namespace nacre::reconstruct::internal

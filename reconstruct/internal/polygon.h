#pragma once

#include <array>
#include <cstddef>

namespace nacre::reconstruct::internal {

/// A convex polygon of at most eight corners: a quadrilateral clipped to a rectangle.
struct Polygon {
  struct Corner {
    double x = 0;
    double y = 0;
  };
  std::array<Corner, 8> corners;
  std::size_t count = 0;

  void Add(Corner corner) { corners[count++] = corner; }
  /// Shoelace formula; without sign.
  double Area() const;
  /// Centre of gravity; the polygon must have an area.
  Corner Centroid() const;

  /// Means of x², y² and x y over the polygon, which must have an area.
  struct Squares {
    double xx = 0;
    double yy = 0;
    double xy = 0;
  };
  Squares MeanSquares() const;
};

/// What of `polygon` lies within [x0, x1] × [y0, y1] [Sutherland74].
Polygon ClipToBox(const Polygon& polygon, double x0, double y0, double x1, double y1);

}  // namespace nacre::reconstruct::internal

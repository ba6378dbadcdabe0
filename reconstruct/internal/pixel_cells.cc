#include "reconstruct/internal/pixel_cells.h"

#include "reconstruct/internal/polygon.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

using Corners = std::vector<Polygon::Corner>;

// Where a corner of pixels lies, in cells from the lattice's upper left corner, +y
// down.
Polygon::Corner CornerAt(const CellLattice& lattice,
                         const calibrate::CameraGeometry& camera,
                         const PlaceOnLattice& place,
                         calibrate::PixelPoint corner) {
  const PointMm seen = camera.SampleFromPixel(corner);
  const PointMm p = place ? place(seen) : seen;
  return {(p.x - lattice.corner_mm.x) / lattice.pitch_mm,
          (lattice.corner_mm.y - p.y) / lattice.pitch_mm};
}

// The corners between pixel rows `row − 1` and `row`.
Corners CornersAbove(const CellLattice& lattice,
                     const calibrate::CameraGeometry& camera,
                     const PlaceOnLattice& place,
                     int row) {
  Corners corners;
  corners.reserve(static_cast<std::size_t>(camera.width_px) + 1);
  for (int column = 0; column <= camera.width_px; ++column) {
    corners.push_back(CornerAt(lattice, camera, place, {column - 0.5, row - 0.5}));
  }
  return corners;
}

// A pixel's corners, clockwise as seen in the picture, and the inverse of the linear
// map from pixel to cell coordinates.
struct Pixel {
  Pixel(const Corners& above, const Corners& below, int column) {
    const auto c = static_cast<std::size_t>(column);
    quad.Add(above[c]);
    quad.Add(above[c + 1]);
    quad.Add(below[c + 1]);
    quad.Add(below[c]);
  }

  // From pixel centre, in pixels.
  Polygon Offset(Polygon piece) const {
    const auto& q = quad.corners;
    const double ux = 0.5 * (q[1].x - q[0].x + q[2].x - q[3].x);
    const double uy = 0.5 * (q[1].y - q[0].y + q[2].y - q[3].y);
    const double vx = 0.5 * (q[3].x - q[0].x + q[2].x - q[1].x);
    const double vy = 0.5 * (q[3].y - q[0].y + q[2].y - q[1].y);
    const Polygon::Corner centre = quad.Centroid();
    const double determinant = ux * vy - uy * vx;
    for (std::size_t n = 0; n < piece.count; ++n) {
      const double x = piece.corners[n].x - centre.x;
      const double y = piece.corners[n].y - centre.y;
      piece.corners[n] = {(x * vy - y * vx) / determinant,
                          (y * ux - x * uy) / determinant};
    }
    return piece;
  }

  Polygon quad;
};

struct Box {
  int begin_x;
  int end_x;
  int begin_y;
  int end_y;
};

Box CellsAround(const Polygon& quad, const CellLattice& lattice, RowBand band) {
  double min_x = quad.corners[0].x;
  double max_x = min_x;
  double min_y = quad.corners[0].y;
  double max_y = min_y;
  for (std::size_t n = 1; n < quad.count; ++n) {
    min_x = std::min(min_x, quad.corners[n].x);
    max_x = std::max(max_x, quad.corners[n].x);
    min_y = std::min(min_y, quad.corners[n].y);
    max_y = std::max(max_y, quad.corners[n].y);
  }
  // Far outside the lattice the numbers may not fit an int: clamped before the cast.
  const auto cell = [](double value, int count) {
    return static_cast<int>(std::floor(std::clamp<double>(value, 0, count)));
  };
  return {cell(min_x, lattice.columns),
          std::min(lattice.columns, cell(max_x, lattice.columns) + (max_x > 0 ? 1 : 0)),
          std::max(band.begin, cell(min_y, lattice.rows)),
          std::min(band.end, cell(max_y, lattice.rows) + (max_y > 0 ? 1 : 0))};
}

struct PixelRow {
  int row;
  const Corners& above;
  const Corners& below;
};

void CutRow(const CellLattice& lattice,
            RowBand band,
            const PixelRow& pixels,
            std::vector<PixelPiece>& pieces) {
  const auto& [row, above, below] = pixels;
  for (int column = 0; column + 1 < static_cast<int>(above.size()); ++column) {
    const Pixel pixel(above, below, column);
    const Box box = CellsAround(pixel.quad, lattice, band);
    for (int y = box.begin_y; y < box.end_y; ++y) {
      for (int x = box.begin_x; x < box.end_x; ++x) {
        const Polygon piece = ClipToBox(pixel.quad, x, y, x + 1, y + 1);
        const double share = piece.Area();
        constexpr double kNothing = 1e-12;
        if (share > kNothing) {
          const Polygon in_pixel = pixel.Offset(piece);
          const Polygon::Corner offset = in_pixel.Centroid();
          const Polygon::Squares squares = in_pixel.MeanSquares();
          constexpr double kWhole = 1.0 / 12;
          pieces.push_back({lattice.Index(x, y),
                            column,
                            row,
                            share,
                            offset.x,
                            offset.y,
                            squares.xx - kWhole,
                            squares.yy - kWhole,
                            squares.xy});
        }
      }
    }
  }
}

}  // namespace

CellLattice::CellLattice(const RdHeader& header)
    : pitch_mm(header.pitch_mm),
      columns(header.points_x + header.core - 1),
      rows(header.points_y + header.core - 1) {
  const PointMm first = header.GridPoint(0, 0);
  corner_mm = {first.x - (header.Radius() + 0.5) * pitch_mm,
               first.y + (header.Radius() + 0.5) * pitch_mm};
}

PointMm CellLattice::Centre(int column, int row) const {
  return {corner_mm.x + (column + 0.5) * pitch_mm,
          corner_mm.y - (row + 0.5) * pitch_mm};
}

// By some places of each line of corners, which bend little in between.
PixelCutter::PixelCutter(const CellLattice& lattice,
                         const calibrate::CameraGeometry& camera,
                         const PlaceOnLattice& place)
    : lattice_(lattice), camera_(camera), place_(place) {
  constexpr int kPlaces = 8;
  for (int row = 0; row <= camera.height_px; ++row) {
    Extent& extent = extents_.emplace_back();
    for (int k = 0; k <= kPlaces; ++k) {
      const double x = -0.5 + static_cast<double>(k) * camera.width_px / kPlaces;
      const double y = CornerAt(lattice, camera, place, {x, row - 0.5}).y;
      extent.least = std::min(extent.least, y);
      extent.most = std::max(extent.most, y);
    }
  }
}

// Whether the corners above a pixel row may lie in the band, or between two such rows
// that do.
bool PixelCutter::MayTouch(RowBand band, int row) const {
  constexpr double kMarginCells = 1;
  const Extent& extent = extents_[static_cast<std::size_t>(row)];
  return extent.most > band.begin - kMarginCells &&
         extent.least < band.end + kMarginCells;
}

std::vector<PixelPiece> PixelCutter::Cut(RowBand band) const {
  std::vector<PixelPiece> pieces;
  Corners above;
  bool was_near = false;
  for (int row = 0; row < camera_.height_px; ++row) {
    const bool is_near = MayTouch(band, row) || MayTouch(band, row + 1);
    if (is_near) {
      if (!was_near) {
        above = CornersAbove(lattice_, camera_, place_, row);
      }
      Corners below = CornersAbove(lattice_, camera_, place_, row + 1);
      CutRow(lattice_, band, {row, above, below}, pieces);
      above = std::move(below);
    }
    was_near = is_near;
  }
  return pieces;
}

}  // namespace nacre::reconstruct::internal

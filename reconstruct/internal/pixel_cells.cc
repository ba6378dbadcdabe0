#include "reconstruct/internal/pixel_cells.h"

#include "core/parallel.h"
#include "reconstruct/internal/polygon.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

using Corners = std::vector<Polygon::Corner>;

// Where the corners between pixel rows `row − 1` and `row` lie, in cells from the
// lattice's upper left corner, +y down.
Corners CornersAbove(const CellLattice& lattice,
                     const calibrate::CameraGeometry& camera,
                     const PlaceOnLattice& place,
                     int row) {
  Corners corners;
  corners.reserve(static_cast<std::size_t>(camera.width_px) + 1);
  for (int column = 0; column <= camera.width_px; ++column) {
    const PointMm seen = camera.SampleFromPixel({column - 0.5, row - 0.5});
    const PointMm p = place ? place(seen) : seen;
    corners.push_back({(p.x - lattice.corner_mm.x) / lattice.pitch_mm,
                       (lattice.corner_mm.y - p.y) / lattice.pitch_mm});
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

  // From pixel centre to `point`, in pixels.
  Polygon::Corner Offset(Polygon::Corner point) const {
    const auto& q = quad.corners;
    const double ux = 0.5 * (q[1].x - q[0].x + q[2].x - q[3].x);
    const double uy = 0.5 * (q[1].y - q[0].y + q[2].y - q[3].y);
    const double vx = 0.5 * (q[3].x - q[0].x + q[2].x - q[1].x);
    const double vy = 0.5 * (q[3].y - q[0].y + q[2].y - q[1].y);
    const Polygon::Corner centre = quad.Centroid();
    const double x = point.x - centre.x;
    const double y = point.y - centre.y;
    const double determinant = ux * vy - uy * vx;
    return {(x * vy - y * vx) / determinant, (y * ux - x * uy) / determinant};
  }

  Polygon quad;
};

struct Box {
  int begin_x;
  int end_x;
  int begin_y;
  int end_y;
};

Box CellsAround(const Polygon& quad, const CellLattice& lattice) {
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
          cell(min_y, lattice.rows),
          std::min(lattice.rows, cell(max_y, lattice.rows) + (max_y > 0 ? 1 : 0))};
}

void CutRow(const CellLattice& lattice,
            const Corners& above,
            const Corners& below,
            int row,
            std::vector<PixelPiece>& pieces) {
  for (int column = 0; column + 1 < static_cast<int>(above.size()); ++column) {
    const Pixel pixel(above, below, column);
    const Box box = CellsAround(pixel.quad, lattice);
    for (int y = box.begin_y; y < box.end_y; ++y) {
      for (int x = box.begin_x; x < box.end_x; ++x) {
        const Polygon piece = ClipToBox(pixel.quad, x, y, x + 1, y + 1);
        const double share = piece.Area();
        constexpr double kNothing = 1e-12;
        if (share > kNothing) {
          const Polygon::Corner offset = pixel.Offset(piece.Centroid());
          pieces.push_back(
              {lattice.Index(x, y), column, row, share, offset.x, offset.y});
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

std::vector<std::vector<PixelPiece>> CutPixels(const CellLattice& lattice,
                                               const calibrate::CameraGeometry& camera,
                                               const PlaceOnLattice& place,
                                               int thread_count) {
  std::vector<std::vector<PixelPiece>> rows(static_cast<std::size_t>(camera.height_px));
  constexpr std::int64_t kBlock = 16;
  ParallelForBlocks(camera.height_px, kBlock, thread_count, [&](auto begin, auto end) {
    Corners above = CornersAbove(lattice, camera, place, static_cast<int>(begin));
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      Corners below = CornersAbove(lattice, camera, place, row + 1);
      CutRow(lattice, above, below, row, rows[static_cast<std::size_t>(row)]);
      above = std::move(below);
    }
  });
  return rows;
}

}  // namespace nacre::reconstruct::internal

#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace nacre::reconstruct::internal {

/// The lattice of cells of pitch² that all windows of a dataset are cut from: cell
/// (u, v) of the window of grid point (i, j) is lattice cell (i + u, j + v).
struct CellLattice {
  explicit CellLattice(const RdHeader& header);
  std::int64_t Index(int column, int row) const {
    return std::int64_t{row} * columns + column;
  }
  std::int64_t CellCount() const { return std::int64_t{columns} * rows; }
  PointMm Centre(int column, int row) const;

  PointMm corner_mm;  ///< upper left, of cell (0, 0)
  double pitch_mm;
  int columns;
  int rows;
};

/// The piece of a pixel that lies in a cell.
struct PixelPiece {
  std::int64_t cell;
  int column;
  int row;
  double share;  ///< of the cell's area
  double du;     ///< its centre from the pixel's, in pixels, right and
  double dv;     ///< down
  double duu;    ///< and the mean squares from there, less those of a whole pixel
  double dvv;
  double duv;
};

/// Where a point seen on the sample's surface lies in the lattice; empty: where it is.
using PlaceOnLattice = std::function<PointMm(PointMm)>;

/// Cells of those rows of a lattice.
struct RowBand {
  int begin;
  int end;
};

/// Cuts a camera's pixels, quadrilaterals of the sample plane, along the lattice.
class PixelCutter {
 public:
  /// All arguments must outlive this.
  PixelCutter(const CellLattice& lattice,
              const calibrate::CameraGeometry& camera,
              const PlaceOnLattice& place);

  /// All pieces of cells in `band`, sorted by pixels.
  std::vector<PixelPiece> Cut(RowBand band) const;

 private:
  // Where the corners above a row of pixels lie, in rows of cells.
  struct Extent {
    double least = 1e30;
    double most = -1e30;
  };
  bool MayTouch(RowBand band, int row) const;

  const CellLattice& lattice_;
  const calibrate::CameraGeometry& camera_;
  const PlaceOnLattice& place_;
  std::vector<Extent> extents_;
};

}  // namespace nacre::reconstruct::internal

#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/pixel_boxes.h"
#include "reconstruct/internal/pixel_cells.h"
#include "reconstruct/rd_dataset.h"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// How far from each grid point its beam really arrived, mm on the sample plane, by the
/// calibrated laser map and the mirrors' hysteresis; slice after slice.
std::vector<PointMm> BeamOffsets(const acquire::SessionReader& session,
                                 const calibrate::Calibration& calibration,
                                 const RdHeader& header);

/// Where the surface lies, and the beams on it.
struct SurfaceModel {
  calibrate::SpotProfile spot;  ///< whose blur is undone
  PlaceOnLattice place;         ///< see PixelModel
  /// Where a point of the lattice lies on the surface that the camera is over; empty:
  /// there.
  PlaceOnLattice on_surface;
  std::vector<PointMm> beam_offsets;  ///< see BeamOffsets
};

/// Windows go with the beams, cells don't: the mean over a cell that is moved by δ is
///   M(x + δ) = M(x) + δ · ∇M,   pitch ∂M/∂x = ∫ right edge − ∫ left edge,
/// to first order. Edges are seen in the picture itself, pixels bilinear, and what
/// spot, pixels and bilinear steps blur is undone to first order.
class WindowShift {
 public:
  WindowShift(const CellLattice& lattice,
              const calibrate::CameraGeometry& camera,
              const RdHeader& header,
              const SurfaceModel& surface,
              int thread_count);

  /// Moves the cells of `means` (all cells of the lattice) in the windows of a group as
  /// far as the nearest spot whose window they are in is off.
  void Apply(const RateFrame& rates,
             std::span<const acquire::GridIndex> group,
             std::span<float> means) const;

  std::size_t MemoryBytes() const { return edges_.Bytes(); }

 private:
  class EdgeBuilder;  // the weights of some edges

  std::size_t Vertical(int column, int row) const;
  std::size_t Horizontal(int column, int row) const;

  CellLattice lattice_;
  RdHeader header_;
  std::vector<PointMm> offsets_;  // in cells, right and down; empty: nothing to do
  PixelBoxes edges_;              // the mean along each; empty if not seen whole
};

}  // namespace nacre::reconstruct::internal

#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "reconstruct/internal/hdr_merge.h"
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

/// Windows go with the beams, cells don't: the mean over a cell that is moved by δ is
///   M(x + δ) = M(x) + δ · ∇M,   pitch ∂M/∂x = ∫ right edge − ∫ left edge,
/// to first order. Edges are seen in the picture itself, pixels bilinear, and what
/// spot, pixels and bilinear steps blur is undone to first order.
class WindowShift {
 public:
  /// `on_surface`: where a point of the lattice lies on the surface that `camera` is
  /// over; empty: there.
  WindowShift(const CellLattice& lattice,
              const calibrate::CameraGeometry& camera,
              const std::function<PointMm(PointMm)>& on_surface,
              const RdHeader& header,
              std::vector<PointMm> offsets,
              const calibrate::SpotProfile& spot);

  /// Moves the cells of `means` (all cells of the lattice) that are nearest to the
  /// spots of a group as far as their spots are off.
  void Apply(const RateFrame& rates,
             std::span<const acquire::GridIndex> group,
             std::span<float> means) const;

  std::size_t MemoryBytes() const { return places_.size() * sizeof(Place); }

 private:
  static constexpr int kPoints = 8;  // of an edge
  // A point of an edge: the upper left one of four pixels, and how far from it.
  struct Place {
    int pixel = -1;  // not in the picture
    float right = 0;
    float down = 0;
  };
  float Sharp(const RateFrame& rates, int pixel) const;
  std::size_t Vertical(int column, int row) const;
  std::size_t Horizontal(int column, int row) const;
  float Edge(const RateFrame& rates, std::size_t edge, bool is_near) const;
  void Move(const RateFrame& rates,
            acquire::GridIndex cell,
            PointMm cells,
            bool is_near,
            std::span<float> means) const;

  CellLattice lattice_;
  RdHeader header_;
  int width_px_;
  int height_px_;
  float blur_px2_;                // half the variance along an axis
  std::vector<PointMm> offsets_;  // in cells, right and down; empty: nothing to do
  std::vector<Place> places_;     // kPoints an edge
};

}  // namespace nacre::reconstruct::internal
